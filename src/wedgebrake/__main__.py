"""``python -m wedgebrake``."""

import os

try:
    from wedgebrake.cli import process_main
except KeyboardInterrupt:  # before ``main`` handles Ctrl-C
    os.write(2, b"interrupted\n")
    os._exit(1)

if __name__ == "__main__":
    process_main()
