"""`python -m nnhydro` is the `nnhydro` command."""

from nnhydro.cli.main import main

if __name__ == "__main__":
    main()
