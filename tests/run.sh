#!/usr/bin/env bash
# Runs every test. Installs Mesa's lavapipe with the system's package manager where no Vulkan device
# is found, and pins it, so that the hardware tests mean the same everywhere. PLAINSIGHT_MODELS may name
# a folder of sample models (see tests/it/compare.rs). Arguments go to cargo test.
set -eu
cd "$(dirname "$0")/.."

drivers() {
  ls /usr/share/vulkan/icd.d/*.json /usr/local/share/vulkan/icd.d/*.json /etc/vulkan/icd.d/*.json 2>/dev/null || true
}

install_lavapipe() {
  echo "tests/run.sh: no Vulkan driver found; installing Mesa's lavapipe" >&2
  local root=""
  if [ "$(id -u)" -ne 0 ]; then root="sudo"; fi
  if command -v apt-get >/dev/null; then
    $root apt-get update -qq
    DEBIAN_FRONTEND=noninteractive $root apt-get install -y -qq --no-install-recommends mesa-vulkan-drivers libvulkan1
  elif command -v dnf >/dev/null; then
    $root dnf install -y mesa-vulkan-drivers vulkan-loader
  elif command -v pacman >/dev/null; then
    $root pacman -S --noconfirm --needed vulkan-swrast vulkan-icd-loader
  elif command -v apk >/dev/null; then
    $root apk add mesa-vulkan-swrast vulkan-loader
  elif command -v zypper >/dev/null; then
    $root zypper --non-interactive install libvulkan_lvp libvulkan1
  else
    echo "tests/run.sh: install Mesa's lavapipe (package mesa-vulkan-drivers or alike) and run this again" >&2
    exit 3
  fi
}

if [ -z "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}" ]; then
  [ -n "$(drivers)" ] || install_lavapipe
  lavapipe=$(drivers | grep -m1 lvp_icd || true)
  if [ -n "$lavapipe" ]; then
    export VK_DRIVER_FILES="$lavapipe"
  fi
fi
# The driver gives large blocks back to the system after every batch; keeping them saves half its time.
export MALLOC_TRIM_THRESHOLD_=8589934592 MALLOC_MMAP_THRESHOLD_=1073741824 MALLOC_TOP_PAD_=67108864

exec cargo test --workspace --locked "$@"
