// SPDX-License-Identifier: Apache-2.0
// LD_PRELOAD=ptyshim.so lets libserialport 0.1.1 open a pseudo-terminal. libserialport refuses one for two reasons:
// /sys/class/tty has no entry for it, and TIOCMGET fails on it. This library answers the look-ups as for /dev/tty0; the
// modem lines read as 0 and accept any setting.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>
static const char *other(const char *p) { return strncmp(p, "/sys/class/tty/pts/", 19) ? p : "/sys/class/tty/tty0"; }
int __lxstat(int version, const char *p, struct stat *s) { (void)version; return fstatat(-100, other(p), s, 0x100); }  // what Debian's libserialport calls
int lstat(const char *p, struct stat *s) { return fstatat(-100, other(p), s, 0x100); }
ssize_t readlink(const char *p, char *b, size_t n) { return readlinkat(-100, other(p), b, n); }
int ioctl(int fd, unsigned long request, ...) {
    va_list l; va_start(l, request); void *arg = va_arg(l, void *); va_end(l);
    static int (*real)(int, unsigned long, void *);
    if (!real) real = (int (*)(int, unsigned long, void *))dlsym(RTLD_NEXT, "ioctl");
    if (ttyname(fd) && !strncmp(ttyname(fd), "/dev/pts/", 9)) {
        if (request == TIOCMGET) { *(int *)arg = 0; return 0; }
        if (request == TIOCMSET || request == TIOCMBIS || request == TIOCMBIC) return 0;
    }
    return real(fd, request, arg);
}
