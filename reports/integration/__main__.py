"""python -m reports.integration"""

import sys

from reports.integration.study import main

if __name__ == "__main__":
    sys.exit(main())
