"""`python -m quadstep` is `quadstep`."""

from quadstep.cli import main

if __name__ == "__main__":
    main()
