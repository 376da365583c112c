"""`python -m chipload`: the command line where the script is not on the path."""

from chipload.cli import main

main()
