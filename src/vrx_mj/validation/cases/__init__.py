"""The cases of the report, by subject; `vrx_mj.validation.report` lists them."""
