#!/usr/bin/env bash
# In: nothing. Out: ffmpeg and a GigE Vision camera that is none (aravis-tools), where they are missing and we are allowed to install them.
# With CI=true a machine that still has none is a failure; for a user it is a sentence.
set -eu
have() { command -v ffmpeg >/dev/null && command -v arv-fake-gv-camera-0.8 >/dev/null; }
if ! have && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
  echo "installing ffmpeg and aravis-tools for the tests of cameras" >&2
  { apt-get -qq update && DEBIAN_FRONTEND=noninteractive apt-get -qq install -y ffmpeg aravis-tools; } >/dev/null 2>&1 || true
fi
if have; then exit 0; fi
echo "ffmpeg or arv-fake-gv-camera-0.8 is missing: tests of cameras that need them are skipped" >&2
[ "${CI:-}" != true ]
