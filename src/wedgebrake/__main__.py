"""``python -m wedgebrake``."""

from wedgebrake.cli import main

if __name__ == "__main__":
    main()
