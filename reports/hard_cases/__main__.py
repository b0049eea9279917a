"""python -m reports.hard_cases"""

import sys

from reports.hard_cases.study import main

if __name__ == "__main__":
    sys.exit(main())
