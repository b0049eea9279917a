"""python -m reports.hard_cases"""

import sys

from reports.hard_cases.study import main

sys.exit(main())
