"""python -m reports.plate_drop"""

import sys

from reports.plate_drop.study import main

if __name__ == "__main__":
    sys.exit(main())
