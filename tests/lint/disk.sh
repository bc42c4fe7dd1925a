# SPDX-License-Identifier: Apache-2.0
# Code that keeps durable data may access files only through common/base/disk.h, where tests simulate a loss of power. Sockets (status/)
# and the clients' programs (coordinator/ctl) are exempt.
cd "$(dirname "$0")/../.." || exit 1
calls='open|openat|creat|opendir|fdopendir|mkdir|mkdirat|rmdir|unlink|unlinkat|remove|rename|renameat|link|symlink|fsync|fdatasync|sync'
calls="$calls|syncfs|read|pread|readv|preadv|write|pwrite|writev|pwritev|fallocate|posix_fallocate|ftruncate|truncate|stat|fstat|lstat"
calls="$calls|fstatat|utimensat|futimens|flock|lockf|close|fopen|fdopen|freopen|tmpfile|fread|fwrite|fputs|fputc|fprintf|fclose|fflush"
calls="$calls|mkstemp|mkostemp|mkdtemp|access|chmod|fchmod|nftw|scandir|statvfs|fstatvfs|sendfile|copy_file_range"
calls="$calls|readdir|closedir|disk_opendir|disk_readdir"
wrong=$(grep -nE "(^|[^A-Za-z0-9_>.])($calls)\(" $(ls coordinator/*/*.c | grep -v "^coordinator/ctl/") common/blob/*.c \
	common/base/checked_file.c common/net/authority.c common/film/canvas*.c common/estimate/*.c | grep -v '^coordinator/status/[a-z_]*\.c:')
if [ -n "$wrong" ]; then
	echo "WRONG: calls of the system for files, past common/base/disk.h"
	echo "$wrong" | sed 's/^/	/'
	exit 1
fi
echo "ok: files are touched through common/base/disk.h alone"
