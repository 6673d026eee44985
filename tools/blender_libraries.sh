#!/usr/bin/env bash
# blender_libraries.sh PYTHON: see that `import bpy` works. Where it does not, install the system libraries it needs
# (as root with apt-get) or name them.
set -euo pipefail
python=${1:?blender_libraries.sh PYTHON}
packages=(libgl1 libice6 libsm6 libx11-6 libxext6 libxfixes3 libxi6 libxkbcommon0 libxrender1)

imports() { "$python" -c 'import bpy' </dev/null >/dev/null 2>&1; }

imports && exit
if [[ $(id -u) == 0 ]] && command -v apt-get >/dev/null; then
  echo "import bpy fails; installing ${packages[*]}"
  export DEBIAN_FRONTEND=noninteractive
  apt-get update -q >/dev/null
  apt-get install -y -q --no-install-recommends "${packages[@]}" >/dev/null
  imports && exit
fi
echo "import bpy fails: $("$python" -c 'import bpy' 2>&1 </dev/null | tail -1); it needs these system packages (Debian's names): ${packages[*]}" >&2
exit 1
