"""python -m reports.tire"""

import sys

from reports.tire.study import main

if __name__ == "__main__":
    sys.exit(main())
