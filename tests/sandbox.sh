# Runs a command as a bare user id without name, home or temporary folder, where only OUT and /dev/shm can be written: a container
# started with --read-only --user 12345:12345. Needs root. Usage: sh sandbox.sh ROOT OUT PYTHON_PREFIX PACKAGES SOURCES COMMAND...
# ROOT: an empty folder to build it in, seen by nobody else. Inside: /python, /packages, /sources, /out.
set -e
root=$1 out=$2 prefix=$3 packages=$4 sources=$5
shift 5
mount -t tmpfs tmpfs "$root"
cd "$root"
mkdir usr etc dev proc out python packages sources
for name in bin lib lib64; do
    if [ -L /$name ]; then cp -P /$name .; elif [ -d /$name ]; then mkdir $name && mount --bind /$name $name; fi
done
mount --bind /usr usr
mount --bind /etc etc
mount --bind "$prefix" python
mount --bind "$packages" packages
mount --bind "$sources" sources
mount --rbind /dev dev
mount -t tmpfs -o mode=1777 tmpfs dev/shm
mount -t proc proc proc
mount --bind "$out" out
mount -o remount,ro "$root"
for name in usr etc python packages sources; do mount -o remount,bind,ro "$root/$name"; done
cd /
exec chroot --userspec=12345:12345 --groups= "$root" \
    env -i PATH=/usr/bin:/bin LD_LIBRARY_PATH=/python/lib PYTHONPATH=/sources:/packages PYTHONDONTWRITEBYTECODE=1 "$@"
