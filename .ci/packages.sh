# shellcheck shell=bash
# Debian packages of the scripts in this folder, which source this file.
#
#     install_packages PACKAGE...    as root, installs those that are missing; else says which they are, and stops the script
#
# apt_options holds a further option of `apt-get install`, apt_advice what to say where that fails.

install_packages() {
    local missing=() package script
    script=$(basename "$0" .sh)
    for package; do
        [ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>&1)" = installed ] || missing+=("$package")
    done
    [ ${#missing[@]} -gt 0 ] || return 0
    [ "$(id -u)" = 0 ] || { echo "$script: not installed: ${missing[*]}; install them, or run this as root" >&2; exit 1; }
    echo "$script: installing ${missing[*]}"
    export DEBIAN_FRONTEND=noninteractive
    # One script at a time, without the lock in what a package starts. Another apt may run, as one that upgrades by itself: wait for it.
    {
        flock 9
        apt-get update 9>&- &&
            apt-get -o DPkg::Lock::Timeout=600 install --yes --no-install-recommends ${apt_options:+"$apt_options"} "${missing[@]}" 9>&-
    } 9>/tmp/sdftool-packages.lock >/dev/null ||
        { echo "$script: apt-get cannot install ${missing[*]}${apt_advice:+; $apt_advice}" >&2; exit 1; }
}
