// SPDX-License-Identifier: Apache-2.0
// LD_PRELOAD=faultshim.so FAULT=stall|error|nodev AFTER=frames: emulates faults of a capture device without fault
// controls (vimc, used through libcamera). After AFTER frames, "stall" keeps every buffer from the kernel's driver (no
// more frames), "error" marks every buffer as broken, "nodev" fails every call on the device as after an unplug.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <linux/videodev2.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
int ioctl(int fd, unsigned long request, ...) {
    va_list l; va_start(l, request); void *arg = va_arg(l, void *); va_end(l);
    static int (*real)(int, unsigned long, void *), frames;
    if (!real) real = (int (*)(int, unsigned long, void *))dlsym(RTLD_NEXT, "ioctl");
    const char *fault = getenv("FAULT"), *after = getenv("AFTER");
    int now = fault && frames >= (after ? atoi(after) : 10);
    if (now && !strcmp(fault, "nodev") && (request & 0xff00) == ('V' << 8)) { errno = ENODEV; return -1; }
    if (now && !strcmp(fault, "stall") && request == VIDIOC_QBUF) return 0;
    int r = real(fd, request, arg);
    if (r == 0 && request == VIDIOC_DQBUF) {
        frames++;
        if (now && !strcmp(fault, "error")) ((struct v4l2_buffer *)arg)->flags |= V4L2_BUF_FLAG_ERROR;
    }
    return r;
}
