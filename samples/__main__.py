"""python -m occlusion_bake.samples NAME... --folder DIR"""

import sys

from .scenes import main

sys.exit(main())
