"""python -m dreammat_cli"""

from dreammat_cli.main import main

main()
