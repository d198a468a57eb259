"""`python -m vrx_mj` is `vrx-mj`."""

from vrx_mj.cli import main

if __name__ == "__main__":
    main()
