#!/usr/bin/env bash
# In: nothing. Out: a Vulkan loader and a driver, where they are missing and we are allowed to install them.
# With CI=true a machine that still has no driver is a failure; for a user it is a sentence.
set -eu
have() {
  # One of the folders is enough; ls fails as soon as one of them is empty, so its output is asked, not its exit code.
  ldconfig -p 2>/dev/null | grep 'libvulkan\.so\.1' >/dev/null &&
    ls /usr/share/vulkan/icd.d/*.json /etc/vulkan/icd.d/*.json 2>/dev/null | grep . >/dev/null
}
if ! have && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
  echo "installing software Vulkan (mesa-vulkan-drivers, libvulkan1)" >&2
  { apt-get -qq update && DEBIAN_FRONTEND=noninteractive apt-get -qq install -y mesa-vulkan-drivers libvulkan1; } >/dev/null 2>&1 || true
fi
if have; then exit 0; fi
echo "no Vulkan driver here: everything runs on the CPU twins (same results, slower)." >&2
echo "to have one: install mesa-vulkan-drivers and libvulkan1, or your graphics card's driver" >&2
[ "${CI:-}" != true ]
