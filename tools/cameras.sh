#!/usr/bin/env bash
# In: nothing. Out: what the tests talk to, where it is missing and we are allowed to install it: ffmpeg, a GigE Vision
# camera that is none (aravis-tools) and a reader of its kind (Aravis for Debian's Python), an MQTT broker (mosquitto),
# and valgrind for the GenTL producer.
# With CI=true a machine that still lacks one is a failure; for a user it is a sentence.
set -eu
PATH="$PATH:/usr/sbin"
reads() { /usr/bin/python3 -c 'import gi; gi.require_version("Aravis", "0.8")'; } 2>/dev/null
have() {
  command -v ffmpeg && command -v arv-fake-gv-camera-0.8 && command -v mosquitto && command -v valgrind && reads
} >/dev/null
if ! have && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
  echo "installing ffmpeg, Aravis, mosquitto and valgrind for the tests of cameras and of the broker" >&2
  # Debian starts a broker on port 1883 when it installs one; the tests start their own.
  { apt-get -qq update && RUNLEVEL=1 DEBIAN_FRONTEND=noninteractive apt-get -qq install -y ffmpeg aravis-tools \
    gir1.2-aravis-0.8 python3-gi mosquitto valgrind; } \
    >/dev/null 2>&1 || true
fi
if have; then exit 0; fi
echo "ffmpeg, aravis-tools, gir1.2-aravis-0.8, mosquitto or valgrind is missing: tests that need them are skipped" >&2
[ "${CI:-}" != true ]
