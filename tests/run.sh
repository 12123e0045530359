#!/usr/bin/env bash
# Runs every test. Installs Mesa's lavapipe with the system's package manager where no Vulkan device
# is found, and a headless Chromium where there is none (it opens the report page), fetches SwiftShader, a
# second and very different driver, and pins both, so that the hardware tests mean the same everywhere. PLAINSIGHT_MODELS may name
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

browser() {
  [ -n "${PLAINSIGHT_CHROMIUM:-}" ] && return
  local name
  for name in chromium-headless-shell chromium chromium-browser google-chrome google-chrome-stable headless_shell; do
    command -v "$name" >/dev/null && return
  done
  return 1
}

install_browser() {
  echo "tests/run.sh: no Chromium found; installing one" >&2
  local root=""
  if [ "$(id -u)" -ne 0 ]; then root="sudo"; fi
  if command -v apt-get >/dev/null; then
    $root apt-get update -qq
    # The shell alone is half the size; not every release has it.
    DEBIAN_FRONTEND=noninteractive $root apt-get install -y -qq --no-install-recommends chromium-headless-shell ||
      DEBIAN_FRONTEND=noninteractive $root apt-get install -y -qq --no-install-recommends chromium
  elif command -v dnf >/dev/null; then
    $root dnf install -y chromium-headless
  elif command -v pacman >/dev/null; then
    $root pacman -S --noconfirm --needed chromium
  elif command -v apk >/dev/null; then
    $root apk add chromium
  elif command -v zypper >/dev/null; then
    $root zypper --non-interactive install chromium
  else
    echo "tests/run.sh: install Chromium, or name it with PLAINSIGHT_CHROMIUM, and run this again" >&2
    exit 3
  fi
}

# SwiftShader comes in an npm package, as a tar file under brotli, which node reads.
swiftshader_package=@sparticuz/chromium@153.0.0
swiftshader_sha256=2f3ceffaaca7d031bc3943f8eacf398a5d9c42c5fe0d15d8840b9acfa630b58e

swiftshader_is_right() {
  echo "$swiftshader_sha256  $1/libvk_swiftshader.so" | sha256sum --check --status 2>/dev/null
}

# Leaves the driver and the loader's file about it in the folder, or nothing.
fetch_swiftshader() {
  local folder="$1" partial
  if ! command -v npm >/dev/null || ! command -v node >/dev/null; then
    echo "tests/run.sh: npm and node fetch SwiftShader, the second Vulkan driver; install them (Debian, Ubuntu: apt-get install npm) and run this again" >&2
    exit 3
  fi
  echo "tests/run.sh: fetching SwiftShader ($swiftshader_package)" >&2
  mkdir -p "$(dirname "$folder")"
  partial=$(mktemp -d "$folder.XXXXXX")
  if ! (
    cd "$partial"
    npm pack --silent "$swiftshader_package" >/dev/null
    tar -xzf ./*.tgz package/bin/swiftshader.tar.br
    node -e 'const fs = require("fs"), zlib = require("zlib");
      fs.writeFileSync("driver.tar", zlib.brotliDecompressSync(fs.readFileSync("package/bin/swiftshader.tar.br")))'
    tar -xf driver.tar libvk_swiftshader.so
    rm -rf ./*.tgz driver.tar package
  ); then
    rm -rf "$partial"
    echo "tests/run.sh: SwiftShader could not be fetched; see above, and run this again with a network" >&2
    exit 3
  fi
  if ! swiftshader_is_right "$partial"; then
    rm -rf "$partial"
    echo "tests/run.sh: SwiftShader has another SHA-256 than $swiftshader_sha256; nothing was kept" >&2
    exit 3
  fi
  rm -rf "$folder"
  mv "$partial" "$folder"
}

browser || install_browser
# A device named by PLAINSIGHT_ADAPTER is not hidden by a pin.
if [ -z "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}${PLAINSIGHT_ADAPTER:-}" ]; then
  [ -n "$(drivers)" ] || install_lavapipe
  lavapipe=$(drivers | grep -m1 lvp_icd || true)
  if [ -n "$lavapipe" ]; then
    export VK_DRIVER_FILES="$lavapipe"
  fi
fi
if [ "$(uname -sm)" = "Linux x86_64" ]; then
  swiftshader="$(mkdir -p "${CARGO_TARGET_DIR:-target}" && cd "${CARGO_TARGET_DIR:-target}" && pwd)/swiftshader"
  swiftshader_is_right "$swiftshader" || fetch_swiftshader "$swiftshader"
  printf '{"file_format_version": "1.0.0", "ICD": {"library_path": "%s", "api_version": "1.1.0"}}\n' \
    "$swiftshader/libvk_swiftshader.so" >"$swiftshader/icd.json"
  pinned="${VK_DRIVER_FILES:-${VK_ICD_FILENAMES:-}}"
  if [ -n "$pinned" ]; then
    export VK_DRIVER_FILES="$pinned:$swiftshader/icd.json"
  else
    export VK_ADD_DRIVER_FILES="$swiftshader/icd.json"
  fi
else
  echo "tests/run.sh: SwiftShader is fetched for Linux on x86_64 alone; the tests that need it will fail" >&2
fi
# Mesa complains on standard error without one, where tests look for a single line.
if [ -z "${XDG_RUNTIME_DIR:-}" ]; then export XDG_RUNTIME_DIR=/tmp; fi
# The driver gives large blocks back to the system after every batch; keeping them saves half its time.
export MALLOC_TRIM_THRESHOLD_=8589934592 MALLOC_MMAP_THRESHOLD_=1073741824 MALLOC_TOP_PAD_=67108864

exec cargo test --workspace --locked "$@"
