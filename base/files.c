/* files.c - directories, whole files, and errors that rank 0 shares. */
#include "files.h"
#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

PetscErrorCode FileMakeDirectory(const char *path)
{
  char        part[BASE_LINE];
  struct stat info;

  PetscFunctionBegin;
  BaseCheckInput(path && path[0], PETSC_COMM_SELF, "The output directory has no name");
  BaseCheckInput(strlen(path) < sizeof(part), PETSC_COMM_SELF, "The directory name is longer than %d characters", BASE_LINE - 1);
  for (size_t k = 1; k <= strlen(path); k++) {
    if (path[k] != '/' && path[k] != 0) continue;
    memcpy(part, path, k);
    part[k] = 0;
    if (mkdir(part, 0777) && errno != EEXIST) BaseCheckInput(!stat(part, &info), PETSC_COMM_SELF, "Cannot create directory '%s': %s", part, strerror(errno));
  }
  BaseCheckInput(!stat(path, &info) && S_ISDIR(info.st_mode), PETSC_COMM_SELF, "'%s' is not a directory; name another place for the output", path);
  BaseCheckInput(!access(path, W_OK | X_OK), PETSC_COMM_SELF, "Directory '%s' is not writable; name another place for the output", path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FileOpen(const char *path, const char *mode, FILE **file)
{
  PetscFunctionBegin;
  *file = fopen(path, mode);
  PetscCheck(*file, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "Cannot open '%s': %s", path, strerror(errno));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FileClose(FILE **file, const char *path)
{
  int failed;

  PetscFunctionBegin;
  if (!*file) PetscFunctionReturn(PETSC_SUCCESS);
  errno  = 0;
  failed = ferror(*file);
  failed = fclose(*file) || failed;
  *file  = NULL;
  PetscCheck(!failed, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "Cannot write '%s': %s", path, errno ? strerror(errno) : "the disk may be full");
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FileSync(const char *path)
{
  const int fd     = open(path, O_RDONLY);
  int       failed = fd < 0 ? errno : 0;

  PetscFunctionBegin;
  if (!failed && fsync(fd) && errno != EINVAL && errno != EROFS && errno != ENOTSUP) failed = errno; /* some file systems cannot sync a directory */
  if (fd >= 0) close(fd);
  PetscCheck(!failed, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "'%s' cannot be brought to the disk: %s", path, strerror(failed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FileCommit(const char *part, const char *path, PetscBool durable)
{
  PetscFunctionBegin;
  if (durable) PetscCall(FileSync(part));
  PetscCheck(!rename(part, path), PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "Cannot rename '%s' to '%s': %s", part, path, strerror(errno));
  if (durable) {
    char  folder[BASE_LINE];
    char *slash;

    BaseFormat(folder, "%s", path);
    slash = strrchr(folder, '/');
    if (slash) slash[slash == folder] = 0;
    PetscCall(FileSync(slash ? folder : "."));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FileCreate(const char *path, FILE **file)
{
  char part[BASE_LINE];

  PetscFunctionBegin;
  PetscCall(BaseFormat(part, "%s.part", path));
  (void)unlink(part); /* a link of that name is not written through */
  PetscCall(FileOpen(part, "w", file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FileFinish(FILE **file, const char *path)
{
  char part[BASE_LINE];

  PetscFunctionBegin;
  PetscCall(BaseFormat(part, "%s.part", path));
  PetscCall(FileClose(file, part));
  PetscCall(FileCommit(part, path, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The mark: 8 letters, then 64 bits of all bytes before it (Fowler, Noll and Vo's hash, over words). HDF5 does not mind bytes behind its end. */
#define SEAL      "cleaved\n"
#define SEAL_SIZE 16

/* Hash of the first `size` bytes; false when they cannot be read. */
static PetscBool Hash(FILE *file, long long size, uint64_t *hash)
{
  unsigned char part[1 << 14];

  *hash = 0xcbf29ce484222325u;
  while (size > 0) {
    const size_t n = size < (long long)sizeof(part) ? (size_t)size : sizeof(part);

    memset(part, 0, sizeof(part));
    if (fread(part, 1, n, file) != n) return PETSC_FALSE;
    for (size_t k = 0; k < n; k += 8) {
      uint64_t word;

      memcpy(&word, part + k, 8);
      *hash = (*hash ^ word) * 0x100000001b3u;
      *hash ^= *hash >> 29;
    }
    size -= (long long)n;
  }
  return PETSC_TRUE;
}

PetscErrorCode FileSeal(const char *path)
{
  FILE       *file;
  struct stat info;
  uint64_t    hash;
  PetscBool   whole;

  PetscFunctionBegin;
  PetscCheck(!stat(path, &info), PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "Cannot find '%s' again: %s", path, strerror(errno));
  PetscCall(FileOpen(path, "rb", &file));
  whole = Hash(file, info.st_size, &hash);
  fclose(file);
  PetscCheck(whole, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "Cannot read '%s' back", path);
  PetscCall(FileOpen(path, "ab", &file));
  fwrite(SEAL, 1, 8, file);
  fwrite(&hash, 1, 8, file);
  PetscCall(FileClose(&file, path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FileIsSealed(const char *path, PetscBool *whole)
{
  FILE       *file;
  struct stat info;
  uint64_t    hash = 0, told = 0;
  char        mark[8] = "";

  PetscFunctionBegin;
  *whole = PETSC_FALSE;
  if (stat(path, &info) || info.st_size < SEAL_SIZE) PetscFunctionReturn(PETSC_SUCCESS);
  file = fopen(path, "rb");
  if (!file) PetscFunctionReturn(PETSC_SUCCESS);
  if (!fseek(file, -SEAL_SIZE, SEEK_END) && fread(mark, 1, 8, file) == 8 && fread(&told, 1, 8, file) == 8 && !memcmp(mark, SEAL, 8)) {
    rewind(file);
    *whole = (PetscBool)(Hash(file, info.st_size - SEAL_SIZE, &hash) && hash == told);
  }
  fclose(file);
  PetscFunctionReturn(PETSC_SUCCESS);
}

const char *FileUnfit(const char *path)
{
  struct stat info;

  if (stat(path, &info)) return errno == ENOENT || errno == ENOTDIR ? "is not there" : errno == ELOOP ? "is a link that leads to itself" : errno == EACCES ? "lies in a folder that may not be read" : "cannot be looked at";
  if (S_ISDIR(info.st_mode)) return "is a directory";
  if (!S_ISREG(info.st_mode)) return "is a device or a pipe, not a file";
  return access(path, R_OK) ? "may not be read; look at its permissions" : NULL;
}

PetscErrorCode FileReadText(const char *path, char **text, size_t *length)
{
  FILE       *file;
  size_t      size = 1 << 16, n = 0;
  const char *unfit = FileUnfit(path);

  PetscFunctionBegin;
  PetscCheck(!unfit, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "Cannot read '%s': it %s", path, unfit);
  PetscCall(FileOpen(path, "rb", &file));
  PetscCall(PetscMalloc1(size, text));
  for (size_t got; (got = fread(*text + n, 1, size - 1 - n, file)) > 0;) {
    n += got;
    if (n == size - 1) {
      size *= 2;
      PetscCall(PetscRealloc(size, text));
    }
  }
  (*text)[n] = 0;
  if (length) *length = n;
  PetscCall(FileClose(&file, path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FileShareError(MPI_Comm comm, PetscErrorCode code, const char *what)
{
  PetscMPIInt rank;
  int         shared = (int)code;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Bcast(&shared, 1, MPI_INT, 0, comm));
  if (rank == 0) PetscCall(code);
  PetscCheck(!shared, comm, (PetscErrorCode)shared, "Rank 0 could not %s", what);
  PetscFunctionReturn(PETSC_SUCCESS);
}
