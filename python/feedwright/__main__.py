"""`python -m feedwright` is the console command."""

from . import main

main()
