/* What a path is, by stat() of POSIX, and why a call failed: Fortran knows neither the struct nor errno. */
#define _POSIX_C_SOURCE 200809L
#include <errno.h>
#include <stdint.h>
#include <string.h>
#include <sys/stat.h>

/* 0: nothing, 1: a regular file, 2: what is none; and by what device and number it is told from others.
   A link is what it leads to if it is followed. */
int razy_look_up(const char *path, int followed, int64_t identity[2])
{
    struct stat found;

    if ((followed ? stat(path, &found) : lstat(path, &found)) != 0)
        return 0;
    identity[0] = (int64_t)found.st_dev;
    identity[1] = (int64_t)found.st_ino;
    return S_ISREG(found.st_mode) ? 1 : 2;
}

/* Why the last call of the system failed, in its words. */
void razy_reason(char *text, size_t length)
{
    strerror_r(errno, text, length);
}
