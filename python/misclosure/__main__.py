"""`python -m misclosure`: the program itself."""

from ._program import main

main()
