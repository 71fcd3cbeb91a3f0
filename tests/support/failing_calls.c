/* Fails one call of the system in a program, told by FAIL=CALL:N (the one with the number N, from 0) or FAIL=CALL:N- (from there on). */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

static int fails(const char *call, atomic_int *count) {
    const char *asked = getenv("FAIL");
    const size_t length = strlen(call);
    if (!asked || strncmp(asked, call, length) || asked[length] != ':')
        return 0;
    char *end;
    const long wanted = strtol(asked + length + 1, &end, 10);
    const int number = atomic_fetch_add(count, 1);
    return *end == '-' ? number >= wanted : number == wanted;
}

#define FAILING(type, name, error, parameters, arguments)                        \
    type name parameters {                                                       \
        static atomic_int count;                                                 \
        if (fails(#name, &count)) {                                              \
            errno = error;                                                       \
            return -1;                                                           \
        }                                                                        \
        return ((type(*) parameters)dlsym(RTLD_NEXT, #name))arguments;           \
    }

FAILING(ssize_t, read, EIO, (int file, void *to, size_t bytes), (file, to, bytes))
FAILING(int, rename, EIO, (const char *from, const char *to), (from, to))
FAILING(int, accept4, EMFILE, (int socket, struct sockaddr *peer, socklen_t *bytes, int flags), (socket, peer, bytes, flags))

typedef int create(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *);

int pthread_create(pthread_t *thread, const pthread_attr_t *how, void *(*begin)(void *), void *with) {
    static atomic_int count;
    if (fails("pthread_create", &count))
        return EAGAIN;
    return ((create *)dlsym(RTLD_NEXT, "pthread_create"))(thread, how, begin, with);
}
