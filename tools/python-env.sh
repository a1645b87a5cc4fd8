#!/usr/bin/env bash
# In: a folder and a set of packages (test, peers). Out: a Python environment with them, for judges and peers only.
# Sheetlight itself never needs Python; without one the tests that need it say that they were skipped.
set -eu
folder=$1 set=$2
case $set in
  test) packages="numpy scipy libigl" ;;
  peers) packages="numpy scipy numba opencv-contrib-python-headless==4.14.*" ;;
  *) echo "python-env.sh: unknown set '$set': test or peers" >&2; exit 2 ;;
esac
stamp="$folder/.has-$set"
[ -e "$stamp" ] && exit 0
if ! { [ -x "$folder/bin/python" ] || python3 -m venv "$folder"; } || ! "$folder/bin/python" -m pip install -q $packages; then
  echo "no Python environment with $packages: the tests that need it will be skipped" >&2
  [ "${CI:-}" != true ]
  exit
fi
touch "$stamp"
