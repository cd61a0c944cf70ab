/* Search for the libraries and the resources folder of an FMU of the python flavour, on Linux and Windows. */
#if defined _WIN32
#define BRIDGE_EXPORT __declspec(dllexport)
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
#else
#define BRIDGE_EXPORT __attribute__((visibility("default")))
#include <dlfcn.h>
#endif

#define PATH_MOST 4096
#define NEWEST 20 /* if the process contains no libpython, the versions from 3.NEWEST down to 3.9 are tried */

#if defined _WIN32
static void *bridge_find(void *library, const char *name) { return (void *)GetProcAddress(library, name); }

/* The folder of this library, with its last separator. */
static int bridge_folder(char *out) {
  static const char here;
  HMODULE own;
  wchar_t wide[PATH_MOST];
  if (!GetModuleHandleExW(GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT, (const wchar_t *)&here, &own)) return 0;
  const DWORD n = GetModuleFileNameW(own, wide, PATH_MOST);
  if (!n || n >= PATH_MOST || !WideCharToMultiByte(CP_UTF8, 0, wide, -1, out, PATH_MOST, NULL, NULL)) return 0;
  char *end = strrchr(out, '\\');
  if (end) end[1] = 0;
  return end != NULL;
}

/* Load pythonfmu's library; returns the error, or NULL. */
static const char *bridge_load(void **library, char *text) {
  wchar_t wide[PATH_MOST];
  char path[2 * PATH_MOST], folder[PATH_MOST];
  (void)text;
  if (!bridge_folder(folder)) return "where its library lies cannot be found";
  snprintf(path, sizeof path, "%spythonfmu-export.dll", folder);
  if (!MultiByteToWideChar(CP_UTF8, 0, path, -1, wide, PATH_MOST)) return "the path to its library is too long";
  *library = LoadLibraryW(wide);
  return *library ? NULL : "pythonfmu-export.dll cannot be loaded: python3.dll (3.9 or newer) must be on the PATH";
}
#else
static void *bridge_find(void *library, const char *name) { return dlsym(library, name); }

/* The folder of this library, with its last separator. */
static int bridge_folder(char *out) {
  static const char here;
  Dl_info own;
  if (!dladdr(&here, &own) || !own.dli_fname || snprintf(out, PATH_MOST, "%s", own.dli_fname) >= PATH_MOST) return 0;
  char *end = strrchr(out, '/');
  if (end) end[1] = 0;
  return end != NULL;
}

/* Load pythonfmu's library. If the process contains no libpython, load libpython first. Returns the error, or NULL. */
static const char *bridge_load(void **library, char *text) {
  char path[2 * PATH_MOST], folder[PATH_MOST];
  if (!bridge_folder(folder)) return "where its library lies cannot be found";
  for (int minor = NEWEST; minor >= 9 && !dlsym(RTLD_DEFAULT, "Py_IsInitialized"); --minor) {
    snprintf(path, sizeof path, "libpython3.%d.so.1.0", minor);
    (void)dlopen(path, RTLD_NOW | RTLD_GLOBAL);
  }
  if (!dlsym(RTLD_DEFAULT, "Py_IsInitialized")) return "there is no libpython (3.9 or newer) in the process, and none is found: preload one (LD_PRELOAD)";
  snprintf(path, sizeof path, "%spythonfmu-export.so", folder);
  *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  if (*library) return NULL;
  const char *said = dlerror();
  snprintf(text, PATH_MOST, "%s", said ? said : "");
  return "pythonfmu-export.so cannot be loaded";
}
#endif

/* The value of a hexadecimal digit; −1 for any other character. */
static int bridge_digit(char c) {
  return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

/* Whether the folder contains the slave. */
static int bridge_is_there(const char *folder) {
  char path[2 * PATH_MOST];
  snprintf(path, sizeof path, "%s/slavemodule.txt", folder);
#if defined _WIN32
  wchar_t wide[PATH_MOST];
  return MultiByteToWideChar(CP_UTF8, 0, path, -1, wide, PATH_MOST) && GetFileAttributesW(wide) != INVALID_FILE_ATTRIBUTES;
#else
  FILE *file = fopen(path, "r");
  if (file) fclose(file);
  return file != NULL;
#endif
}

/* Find the resources folder from the host's URI, or else relative to this library. The URI may have escapes; it begins with file:/,
 * file:// or file:///. Returns whether the folder exists. */
static int bridge_resources(const char *uri, char *out) {
  const char *from = uri ? uri : "";
  char *to = out, *last = out + PATH_MOST - 1;
  if (!strncmp(from, "file:", 5)) {
    from += 5;
    if (!strncmp(from, "//", 2)) from += 2;
    if (!strncmp(from, "localhost/", 10)) from += 9;
#if defined _WIN32
    if (*from == '/' && from[1] && (from[2] == ':' || from[2] == '|')) ++from;
#endif
  }
  while (*from && to < last) {
    const int high = *from == '%' ? bridge_digit(from[1]) : -1, low = high < 0 ? -1 : bridge_digit(from[2]);
    *to++ = low < 0 ? *from : (char)(16 * high + low);
    from += low < 0 ? 1 : 3;
  }
  *to = 0;
  while (to > out + 1 && (to[-1] == '/' || to[-1] == '\\')) *--to = 0;
  if (*out && !*from && bridge_is_there(out)) return 1;
  if (!bridge_folder(out) || strlen(out) + 20 > PATH_MOST) return 0;
  strcat(out, "../../resources");
  return bridge_is_there(out);
}

/* Convert a path to a form that pythonfmu accepts. Returns the error, or NULL. */
static const char *bridge_plain(char *path) {
#if defined _WIN32
  wchar_t wide[PATH_MOST], brief[PATH_MOST];
  int plain = 1;
  if (MultiByteToWideChar(CP_UTF8, 0, path, -1, wide, PATH_MOST) && GetShortPathNameW(wide, brief, PATH_MOST))
    WideCharToMultiByte(CP_UTF8, 0, brief, -1, path, PATH_MOST, NULL, NULL);
  for (const char *c = path; *c; ++c) plain = plain && (unsigned char)*c < 128;
  if (!plain) return "pythonfmu reads paths of ASCII characters only on Windows: unpack it elsewhere";
#endif
  return strstr(path, "%20") ? "pythonfmu takes %20 in a path for a blank: unpack it elsewhere" : NULL;
}
