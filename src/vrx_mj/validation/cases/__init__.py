"""The cases of the report, by subject; `vrx_mj.validation.table` lists them."""
