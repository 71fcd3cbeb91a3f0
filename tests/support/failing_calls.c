/* Fails calls of the system in a program, told by FAIL=CALL:N (the one with the number N, from 0) or FAIL=CALL:N- (from there on), with
 * the error of FAIL_WITH (a number). Counts them where COUNT names a file. The calls are those of the kernel, so that libraries which
 * call it by themselves fail too: a seccomp filter hands each to this library, which makes it or does not. A program that such a
 * program starts would inherit the filter and end. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <ucontext.h>
#include <unistd.h>

enum kind { READ, OPEN, MMAP, RENAME, WRITE, FSYNC, ACCEPT, THREAD, KINDS };
static const char *const NAMES[KINDS] = {"read", "open", "mmap", "rename", "write", "fsync", "accept", "thread"};
static const int ERRORS[KINDS] = {EIO, EACCES, ENOMEM, EIO, ENOSPC, EIO, EMFILE, EAGAIN};
static const struct { int call; enum kind kind; } CALLS[] = {
    {SYS_read, READ}, {SYS_pread64, READ}, {SYS_readv, READ}, {SYS_open, OPEN}, {SYS_openat, OPEN}, {SYS_mmap, MMAP},
    {SYS_rename, RENAME}, {SYS_renameat, RENAME}, {SYS_renameat2, RENAME}, {SYS_write, WRITE}, {SYS_pwrite64, WRITE},
    {SYS_writev, WRITE}, {SYS_fsync, FSYNC}, {SYS_fdatasync, FSYNC}, {SYS_accept4, ACCEPT},
};
#define LENGTH(array) (sizeof(array) / sizeof *(array))

static enum kind failing = KINDS;
static long first, last;
static int error;
static atomic_long counts[KINDS];

static int fails(enum kind kind) {
    const long number = atomic_fetch_add(&counts[kind], 1);
    return kind == failing && first <= number && number <= last;
}

/* Makes a call; the filter lets it through by where it is made from. */
extern long passed(long call, const greg_t arguments[6]);
extern const char passed_from[];
__asm__(".text\n.globl passed\n.hidden passed\n.globl passed_from\n.hidden passed_from\n"
        "passed: mov %rdi, %rax\n mov %rsi, %rcx\n mov (%rcx), %rdi\n mov 8(%rcx), %rsi\n mov 16(%rcx), %rdx\n"
        "mov 24(%rcx), %r10\n mov 32(%rcx), %r8\n mov 40(%rcx), %r9\n syscall\npassed_from: ret\n");

static void called(int signal, siginfo_t *about, void *state) {
    greg_t *registers = ((ucontext_t *)state)->uc_mcontext.gregs;
    const greg_t arguments[6] = {registers[REG_RDI], registers[REG_RSI], registers[REG_RDX],
                                 registers[REG_R10], registers[REG_R8],  registers[REG_R9]};
    for (size_t i = 0; i < LENGTH(CALLS); i++)
        if (CALLS[i].call == about->si_syscall && fails(CALLS[i].kind)) {
            registers[REG_RAX] = -error;
            return;
        }
    registers[REG_RAX] = passed(about->si_syscall, arguments);
    (void)signal;
}

#define FIELD(name) BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, name))
#define HIGH(name) BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, name) + 4)
#define EQUALS(value, yes, no) BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, (value), (yes), (no))
#define ANSWER(what) BPF_STMT(BPF_RET | BPF_K, (what))

static void filter(void) {
    const unsigned long from = (unsigned long)passed_from;
    struct sock_filter program[16 + 2 * LENGTH(CALLS)] = {
        FIELD(instruction_pointer), EQUALS((unsigned)from, 0, 3),
        HIGH(instruction_pointer), EQUALS((unsigned)(from >> 32), 0, 1),
        ANSWER(SECCOMP_RET_ALLOW),
        FIELD(nr),
        /* Memory without a file is not asked for here, and what is told on stdout and stderr arrives. */
        EQUALS(SYS_mmap, 0, 3), FIELD(args[4]), EQUALS(0xffffffff, 0, 5), ANSWER(SECCOMP_RET_ALLOW),
        EQUALS(SYS_write, 0, 3), FIELD(args[0]), BPF_JUMP(BPF_JMP | BPF_JGT | BPF_K, 2, 1, 0), ANSWER(SECCOMP_RET_ALLOW),
        FIELD(nr),
    };
    size_t end = 15;
    for (size_t i = 0; i < LENGTH(CALLS); i++) {
        program[end++] = (struct sock_filter)EQUALS(CALLS[i].call, 0, 1);
        program[end++] = (struct sock_filter)ANSWER(SECCOMP_RET_TRAP);
    }
    program[end++] = (struct sock_filter)ANSWER(SECCOMP_RET_ALLOW);
    const struct sock_fprog all = {.len = end, .filter = program};
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) || prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &all)) {
        perror("failing_calls: no seccomp");
        _exit(99);
    }
}

__attribute__((constructor)) static void begin(void) {
    const char *asked = getenv("FAIL"), *with = getenv("FAIL_WITH");
    const size_t length = asked ? strcspn(asked, ":") : 0;
    for (int kind = 0; kind < KINDS && length; kind++)
        if (strlen(NAMES[kind]) == length && !strncmp(asked, NAMES[kind], length)) {
            char *end;
            failing = kind;
            first = strtol(asked + length + 1, &end, 10);
            last = *end == '-' ? __LONG_MAX__ : first;
            error = with ? atoi(with) : ERRORS[kind];
        }
    struct sigaction action = {.sa_sigaction = called, .sa_flags = SA_SIGINFO | SA_NODEFER | SA_RESTART};
    sigaction(SIGSYS, &action, NULL);
    filter();
}

__attribute__((destructor)) static void end(void) {
    const char *path = getenv("COUNT");
    FILE *file = path ? (failing = KINDS, fopen(path, "w")) : NULL;
    for (int kind = 0; kind < KINDS && file; kind++)
        fprintf(file, "%s %ld\n", NAMES[kind], atomic_load(&counts[kind]));
    if (file)
        fclose(file);
}

typedef int create(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *);

int pthread_create(pthread_t *thread, const pthread_attr_t *how, void *(*run)(void *), void *with) {
    if (fails(THREAD))
        return error;
    return ((create *)dlsym(RTLD_NEXT, "pthread_create"))(thread, how, run, with);
}
