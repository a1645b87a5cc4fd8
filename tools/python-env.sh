#!/usr/bin/env bash
# Makes a Python environment with a set of packages (test, files, genicam, sparkplug, peers) in a folder: for judges,
# peers and the tests of the Python package. `genicam` has a GenICam program, which tests the GenTL producer. `sparkplug`
# has a reader of Sparkplug B; it needs a folder of its own, because it asks for an older paho-mqtt than `files` has.
# `files` has what its files, conversions, notebooks and tables need and are read again with: 0.7 GB, half of them OpenCV
# and Arrow. Ray (0.25 GB) is installed by hand: pip install ray. Sheetlight itself never needs Python; without one the
# tests that need it say that they were skipped.
set -eu
folder=$1 set=$2
case $set in
  test) packages="numpy scipy libigl maturin==1.* mypy prometheus-client pytest" ;;
  files) packages="duckdb laspy[lazrs] matplotlib mcap mcap-ros2-support opencv-contrib-python-headless==4.14.* pyarrow"
    packages="$packages pye57 asyncua==2.1.* eclipse-zenoh==1.* paho-mqtt==2.* pymodbus==3.16.* pypcd4 rosbags"
    packages="$packages tifffile trimesh xarray xxhash openapi-python-client==0.29.*;python_version>='3.11'" ;;
  genicam) packages="harvesters==1.4.* numpy" ;;
  sparkplug) packages="pysparkplug==0.6.*" ;;
  peers) packages="numpy scipy numba opencv-contrib-python-headless==4.14.*" ;;
  *) echo "python-env.sh: unknown set '$set': test, files, genicam, sparkplug or peers" >&2; exit 2 ;;
esac
# Holds the packages, so that an environment of a former version gets what is new.
stamp="$folder/.has-$set"
[ -e "$stamp" ] && [ "$(cat "$stamp")" = "$packages" ] && exit 0
make_it() { [ -x "$folder/bin/python" ] || python3 -m venv "$folder"; }
if ! make_it || ! "$folder/bin/python" -m pip install -q $packages; then
  echo "no Python environment with $packages: the tests that need it will be skipped" >&2
  [ "${CI:-}" != true ]
  exit
fi
echo "$packages" >"$stamp"
