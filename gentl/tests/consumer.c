/* A program that uses the producer as the standard allows, and as it does not: opens and closes all modules again and
 * again, and calls functions with handles, pointers and sizes that are wrong.
 *
 * consumer LIBRARY rounds N    N rounds of opening and closing; memory must not grow
 * consumer LIBRARY misuse N    wrong calls, N times
 * Numbers and signatures are those of GenTL 1.5, written here a second time. */
#include <dlfcn.h>
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef void *H;
#define OK 0
#define NOT_INITIALIZED (-1002)
#define NOT_IMPLEMENTED (-1003)
#define IN_USE (-1004)
#define DENIED (-1005)
#define BAD_HANDLE (-1006)
#define BAD_ID (-1007)
#define BAD_PARAMETER (-1009)
#define TIMEOUT (-1011)
#define ABORTED (-1012)
#define NOT_AVAILABLE (-1014)
#define BAD_ADDRESS (-1015)
#define TOO_SMALL (-1016)
#define BAD_INDEX (-1017)
#define BAD_VALUE (-1019)
#define BUSY (-1022)
#define NEW_BUFFER 1

static int32_t (*GCInitLib)(void), (*GCCloseLib)(void), (*TLClose)(H), (*IFClose)(H), (*DevClose)(H), (*DSClose)(H);
static int32_t (*GCGetInfo)(int32_t, int32_t *, void *, size_t *);
static int32_t (*GCGetLastError)(int32_t *, char *, size_t *);
static int32_t (*TLOpen)(H *), (*TLGetInterfaceID)(H, uint32_t, char *, size_t *);
static int32_t (*TLOpenInterface)(H, const char *, H *), (*TLUpdateInterfaceList)(H, uint8_t *, uint64_t);
static int32_t (*IFUpdateDeviceList)(H, uint8_t *, uint64_t), (*IFGetNumDevices)(H, uint32_t *);
static int32_t (*IFGetDeviceID)(H, uint32_t, char *, size_t *);
static int32_t (*IFGetDeviceInfo)(H, const char *, int32_t, int32_t *, void *, size_t *);
static int32_t (*IFOpenDevice)(H, const char *, int32_t, H *), (*DevGetPort)(H, H *);
static int32_t (*DevOpenDataStream)(H, const char *, H *), (*DevGetDataStreamID)(H, uint32_t, char *, size_t *);
static int32_t (*DSAnnounceBuffer)(H, void *, size_t, void *, H *);
static int32_t (*DSAllocAndAnnounceBuffer)(H, size_t, void *, H *), (*DSQueueBuffer)(H, H);
static int32_t (*DSRevokeBuffer)(H, H, void **, void **), (*DSFlushQueue)(H, int32_t);
static int32_t (*DSStartAcquisition)(H, int32_t, uint64_t), (*DSStopAcquisition)(H, int32_t);
static int32_t (*DSGetInfo)(H, int32_t, int32_t *, void *, size_t *);
static int32_t (*DSGetBufferInfo)(H, H, int32_t, int32_t *, void *, size_t *);
static int32_t (*DSGetBufferID)(H, uint32_t, H *), (*DSGetNumBufferParts)(H, H, uint32_t *);
static int32_t (*DSGetBufferPartInfo)(H, H, uint32_t, int32_t, int32_t *, void *, size_t *);
static int32_t (*DSGetBufferChunkData)(H, H, void *, size_t *);
static int32_t (*IFGetParentTL)(H, H *), (*DevGetParentIF)(H, H *), (*DSGetParentDev)(H, H *);
static int32_t (*GCRegisterEvent)(H, int32_t, H *), (*GCUnregisterEvent)(H, int32_t);
static int32_t (*EventGetData)(H, void *, size_t *, uint64_t), (*EventKill)(H), (*EventFlush)(H);
static int32_t (*EventGetInfo)(H, int32_t, int32_t *, void *, size_t *);
static int32_t (*EventGetDataInfo)(H, const void *, size_t, int32_t, int32_t *, void *, size_t *);
static int32_t (*GCReadPort)(H, uint64_t, void *, size_t *), (*GCWritePort)(H, uint64_t, void *, size_t *);
static int32_t (*GCGetPortURL)(H, char *, size_t *), (*GCGetNumPortURLs)(H, uint32_t *);
static int32_t (*GCGetPortInfo)(H, int32_t, int32_t *, void *, size_t *);
static int32_t (*GCGetPortURLInfo)(H, uint32_t, int32_t, int32_t *, void *, size_t *);
static int32_t (*GCReadPortStacked)(H, void *, size_t *), (*GCWritePortStacked)(H, void *, size_t *);

static void *library;

static void *find(const char *name) {
  void *f = dlsym(library, name);
  if (!f) { printf("%s is missing\n", name); exit(1); }
  return f;
}

static void load(const char *path) {
  library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  if (!library) { printf("%s\n", dlerror()); exit(1); }
#define FIND(f) *(void **)&f = find(#f)
  FIND(GCInitLib); FIND(GCCloseLib); FIND(TLClose); FIND(IFClose); FIND(DevClose); FIND(DSClose); FIND(GCGetInfo);
  FIND(GCGetLastError); FIND(TLOpen); FIND(TLGetInterfaceID); FIND(TLOpenInterface); FIND(TLUpdateInterfaceList);
  FIND(IFUpdateDeviceList); FIND(IFGetNumDevices); FIND(IFGetDeviceID); FIND(IFGetDeviceInfo); FIND(IFOpenDevice);
  FIND(DevGetPort); FIND(DevOpenDataStream); FIND(DevGetDataStreamID); FIND(DSAnnounceBuffer);
  FIND(DSAllocAndAnnounceBuffer); FIND(DSQueueBuffer); FIND(DSRevokeBuffer); FIND(DSFlushQueue);
  FIND(DSStartAcquisition); FIND(DSStopAcquisition); FIND(DSGetInfo); FIND(DSGetBufferInfo); FIND(DSGetBufferID);
  FIND(DSGetNumBufferParts); FIND(DSGetBufferPartInfo); FIND(DSGetBufferChunkData); FIND(IFGetParentTL);
  FIND(DevGetParentIF); FIND(DSGetParentDev); FIND(GCRegisterEvent); FIND(GCUnregisterEvent); FIND(EventGetData);
  FIND(EventKill); FIND(EventFlush); FIND(EventGetInfo); FIND(EventGetDataInfo); FIND(GCReadPort); FIND(GCWritePort);
  FIND(GCGetPortURL); FIND(GCGetNumPortURLs); FIND(GCGetPortInfo); FIND(GCGetPortURLInfo); FIND(GCReadPortStacked);
  FIND(GCWritePortStacked);
  /* The others that consumers look up. */
  const char *rest[] = {"TLGetInfo", "TLGetNumInterfaces", "TLGetInterfaceInfo", "IFGetInfo", "DevGetInfo",
                        "DevGetNumDataStreams"};
  for (size_t i = 0; i < sizeof rest / sizeof *rest; i++) find(rest[i]);
}

static int failures;

static void is_(int32_t got, int32_t want, const char *call, int line) {
  if (got == want) return;
  char text[2048] = "";
  size_t size = sizeof text;
  int32_t code = 0;
  GCGetLastError(&code, text, &size);
  printf("line %d: %s is %d, not %d: %s\n", line, call, got, want, text);
  failures++;
}
#define IS(call, want) is_((call), (want), #call, __LINE__)
#define MUST(condition) \
  do { if (!(condition)) { printf("line %d: %s\n", __LINE__, #condition); failures++; } } while (0)

static long resident_kb(void) {
  long pages = 0, resident = 0;
  FILE *f = fopen("/proc/self/statm", "r");
  if (f && fscanf(f, "%ld %ld", &pages, &resident) != 2) resident = 0;
  if (f) fclose(f);
  return resident * (sysconf(_SC_PAGESIZE) / 1024);
}

struct open { H tl, i, dev, port, ds, event; };

static void open_all(struct open *o) {
  char id[256];
  size_t size = sizeof id;
  uint32_t count = 0;
  IS(GCInitLib(), OK);
  IS(TLOpen(&o->tl), OK);
  IS(TLUpdateInterfaceList(o->tl, NULL, 100), OK);
  IS(TLGetInterfaceID(o->tl, 0, id, &size), OK);
  IS(TLOpenInterface(o->tl, id, &o->i), OK);
  IS(IFUpdateDeviceList(o->i, NULL, 100), OK);
  IS(IFGetNumDevices(o->i, &count), OK);
  MUST(count >= 2);
  size = sizeof id;
  IS(IFGetDeviceID(o->i, 0, id, &size), OK);
  IS(IFOpenDevice(o->i, id, 3, &o->dev), OK);
  IS(DevGetPort(o->dev, &o->port), OK);
  size = sizeof id;
  IS(DevGetDataStreamID(o->dev, 0, id, &size), OK);
  IS(DevOpenDataStream(o->dev, id, &o->ds), OK);
  IS(GCRegisterEvent(o->ds, NEW_BUFFER, &o->event), OK);
}

static uint64_t payload(H ds) {
  size_t bytes = 0, size = sizeof bytes;
  IS(DSGetInfo(ds, 7, NULL, &bytes, &size), OK);
  return bytes;
}

/* The address of a feature's register, from the description of the port. */
static uint64_t address(H port, const char *feature) {
  static char *xml;
  static size_t length;
  if (!xml) {
    char url[256];
    size_t size = sizeof url;
    uint64_t at = 0, bytes = 0;
    IS(GCGetPortURL(port, url, &size), OK);
    if (sscanf(strchr(url, ';'), ";%lx;%lx", &at, &bytes) != 2) { printf("%s\n", url); exit(1); }
    xml = calloc(bytes + 1, 1);
    length = bytes;
    IS(GCReadPort(port, at, xml, &length), OK);
    MUST(length == bytes);
  }
  char name[128];
  snprintf(name, sizeof name, "Name=\"%s_Reg\"><Address>", feature);
  char *at = strstr(xml, name);
  if (!at) { printf("%s is not described\n", feature); exit(1); }
  return strtoull(at + strlen(name), NULL, 16);
}

static int32_t write_(H port, const char *feature, int64_t value) {
  size_t size = sizeof value;
  return GCWritePort(port, address(port, feature), &value, &size);
}

static void rounds(int n) {
  long before = 0;
  int warm = n / 5 + 5;
  for (int k = 0; k < n + warm; k++) {
    struct open o;
    if (k == warm) before = resident_kb();
    open_all(&o);
    uint64_t bytes = payload(o.ds);
    H buffers[3];
    void *memory = malloc(bytes);
    IS(DSAllocAndAnnounceBuffer(o.ds, bytes, NULL, &buffers[0]), OK);
    IS(DSAllocAndAnnounceBuffer(o.ds, bytes, NULL, &buffers[1]), OK);
    IS(DSAnnounceBuffer(o.ds, memory, bytes, (void *)7, &buffers[2]), OK);
    for (int b = 0; b < 3; b++) IS(DSQueueBuffer(o.ds, buffers[b]), OK);
    IS(DSStartAcquisition(o.ds, 0, UINT64_MAX), OK);
    IS(write_(o.port, "AcquisitionStart", 1), OK);
    void *data[2] = {0};
    size_t size = sizeof data;
    IS(EventGetData(o.event, data, &size, 10000), OK);
    MUST(data[0] == buffers[0]);
    switch (k % 3) {
    case 0: /* in order */
      IS(write_(o.port, "AcquisitionStop", 1), OK);
      IS(DSStopAcquisition(o.ds, 0), OK);
      IS(DSFlushQueue(o.ds, 4), OK);
      for (int b = 0; b < 3; b++) {
        void *given = NULL, *user = NULL;
        IS(DSRevokeBuffer(o.ds, buffers[b], &given, &user), OK);
        MUST(given == (b == 2 ? memory : NULL) && user == (b == 2 ? (void *)7 : NULL));
      }
      IS(GCUnregisterEvent(o.ds, NEW_BUFFER), OK);
      IS(DSClose(o.ds), OK);
      IS(DevClose(o.dev), OK);
      IS(IFClose(o.i), OK);
      IS(TLClose(o.tl), OK);
      break;
    case 1: /* the device with all that was opened from it, while it acquires */
      IS(DevClose(o.dev), OK);
      IS(DSClose(o.ds), BAD_HANDLE);
      break;
    default: /* everything open */
      break;
    }
    IS(GCCloseLib(), OK);
    free(memory);
  }
  long after = resident_kb();
  printf("%d rounds: %ld kB before, %ld kB after\n", n, before, after);
  /* The allocator keeps some pages; 10,000 rounds that lost a kilobyte each would be ten times that. Short runs, as
   * under valgrind, say nothing. */
  MUST(n < 100 || after - before < 1024);
}

struct waiter { H event; int32_t result; };

static void *wait_for_data(void *argument) {
  struct waiter *w = argument;
  void *data[2];
  size_t size = sizeof data;
  w->result = EventGetData(w->event, data, &size, UINT64_MAX);
  return NULL;
}

static void not_initialized(void) {
  H h = NULL;
  char text[256];
  size_t size = sizeof text;
  int32_t code = 0;
  IS(TLOpen(&h), NOT_INITIALIZED);
  IS(GCCloseLib(), NOT_INITIALIZED);
  IS(IFClose((H)16), NOT_INITIALIZED);
  IS(DSQueueBuffer((H)16, (H)32), NOT_INITIALIZED);
  IS(GCGetLastError(&code, text, &size), OK);
  MUST(code == NOT_INITIALIZED && strstr(text, "GCInitLib"));
}

static void sizes(struct open *o) {
  char text[256];
  size_t size = 0, full;
  int32_t kind = 0;
  IS(GCGetInfo(0, &kind, NULL, &size), OK);
  MUST(kind == 1 && size > 1);
  full = size;
  size = full - 1;
  IS(GCGetInfo(0, &kind, text, &size), TOO_SMALL);
  MUST(size == full);
  size = full;
  IS(GCGetInfo(0, &kind, text, &size), OK);
  MUST(strlen(text) + 1 == full);
  IS(GCGetInfo(0, &kind, text, NULL), BAD_PARAMETER);
  IS(GCGetInfo(999, &kind, text, &size), NOT_IMPLEMENTED);
  uint64_t number;
  size = 3;
  IS(DSGetInfo(o->ds, 7, &kind, &number, &size), TOO_SMALL);
  MUST(size == sizeof(size_t));
  size = sizeof text;
  IS(IFGetDeviceID(o->i, 99, text, &size), BAD_INDEX);
  IS(IFGetDeviceInfo(o->i, "nobody", 0, &kind, text, &size), BAD_ID);
  IS(IFGetDeviceInfo(o->i, NULL, 0, &kind, text, &size), BAD_PARAMETER);
  int32_t access = 0;
  size = sizeof access;
  IS(IFGetDeviceInfo(o->i, "broken", 5, &kind, &access, &size), OK);
  MUST(access == 3);
  H h;
  IS(IFOpenDevice(o->i, "broken", 3, &h), DENIED);
  size = sizeof text;
  GCGetLastError(&kind, text, &size);
  MUST(kind == DENIED);
}

static void closed(struct open *o) {
  H all[] = {NULL, (H)1, (H)-1, (H)0x53480008, (H)(intptr_t)&failures};
  char text[64];
  size_t size = sizeof text, one = 1;
  uint32_t n;
  for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
    H h = all[k], out;
    IS(TLClose(h), BAD_HANDLE); IS(IFClose(h), BAD_HANDLE); IS(DevClose(h), BAD_HANDLE); IS(DSClose(h), BAD_HANDLE);
    IS(IFGetNumDevices(h, &n), BAD_HANDLE); IS(DevGetPort(h, &out), BAD_HANDLE); IS(EventKill(h), BAD_HANDLE);
    IS(EventGetData(h, text, &size, 0), BAD_HANDLE); IS(EventFlush(h), BAD_HANDLE);
    IS(GCReadPort(h, 0, text, &one), BAD_HANDLE); IS(GCWritePort(h, 0, text, &one), BAD_HANDLE);
    IS(DSQueueBuffer(h, h), BAD_HANDLE); IS(DSQueueBuffer(o->ds, h), BAD_HANDLE);
    IS(DSRevokeBuffer(o->ds, h, NULL, NULL), BAD_HANDLE); IS(DSStartAcquisition(h, 0, 1), BAD_HANDLE);
    IS(DSGetBufferInfo(o->ds, h, 0, NULL, text, &size), BAD_HANDLE); IS(GCRegisterEvent(h, 1, &out), BAD_HANDLE);
    IS(IFGetParentTL(h, &out), BAD_HANDLE); IS(DevGetParentIF(h, &out), BAD_HANDLE);
    IS(DSGetParentDev(h, &out), BAD_HANDLE); IS(GCGetPortURL(h, text, &size), BAD_HANDLE);
    IS(GCReadPortStacked(h, text, &one), BAD_HANDLE); IS(DSGetNumBufferParts(o->ds, h, &n), BAD_HANDLE);
  }
  /* A handle of another kind. */
  IS(DSClose(o->tl), BAD_HANDLE);
  IS(TLClose(o->ds), BAD_HANDLE);
  IS(EventKill(o->dev), BAD_HANDLE);
  H out;
  IS(TLOpen(&out), IN_USE);
  IS(TLOpen(NULL), BAD_PARAMETER);
  IS(GCInitLib(), IN_USE);
  IS(TLOpenInterface(o->tl, "sheetlight", &out), IN_USE);
  IS(TLOpenInterface(o->tl, "other", &out), BAD_ID);
  IS(TLOpenInterface(o->tl, "sheetlight", NULL), BAD_PARAMETER);
  IS(DevOpenDataStream(o->dev, "stream0", &out), IN_USE);
  IS(DevOpenDataStream(o->dev, "none", &out), BAD_ID);
  IS(DevGetPort(o->dev, NULL), BAD_PARAMETER);
  IS(GCRegisterEvent(o->ds, NEW_BUFFER, &out), IN_USE);
  IS(GCRegisterEvent(o->ds, 4, &out), NOT_IMPLEMENTED);
  IS(GCRegisterEvent(o->ds, 77, &out), BAD_PARAMETER);
  IS(GCRegisterEvent(o->dev, NEW_BUFFER, &out), NOT_IMPLEMENTED);
  IS(GCUnregisterEvent(o->dev, 0), BAD_PARAMETER);
}

struct entry { uint64_t address; void *buffer; size_t size; } __attribute__((packed));

static void registers(struct open *o) {
  uint64_t width = address(o->port, "Width"), most = address(o->port, "WidthMax");
  int64_t value = 0;
  size_t size = sizeof value;
  IS(GCReadPort(o->port, most, &value, &size), OK);
  int64_t columns = value;
  IS(write_(o->port, "Width", 0), BAD_VALUE);
  IS(write_(o->port, "Width", columns + 1), BAD_VALUE);
  IS(write_(o->port, "Width", INT64_MIN), BAD_VALUE);
  IS(write_(o->port, "WidthMax", columns), DENIED);
  IS(write_(o->port, "AcquisitionMode", 99), BAD_VALUE);
  IS(write_(o->port, "TriggerSoftware", 1), DENIED);
  IS(write_(o->port, "Width", columns - 1), OK);
  size = sizeof value;
  IS(GCReadPort(o->port, width, &value, &size), OK);
  MUST(value == columns - 1);
  IS(write_(o->port, "OffsetX", 2), BAD_VALUE);
  IS(write_(o->port, "OffsetX", 1), OK);
  IS(write_(o->port, "OffsetX", 0), OK);
  IS(write_(o->port, "Width", columns), OK);
  size = 4;
  IS(GCWritePort(o->port, width, &value, &size), BAD_ADDRESS);
  size = 8;
  IS(GCWritePort(o->port, width + 1, &value, &size), BAD_ADDRESS);
  IS(GCWritePort(o->port, 0, &value, &size), BAD_ADDRESS);
  IS(GCWritePort(o->port, 0x10000000, &value, &size), DENIED);
  IS(GCReadPort(o->port, UINT64_MAX, &value, &size), BAD_ADDRESS);
  size = SIZE_MAX;
  IS(GCReadPort(o->port, width, &value, &size), BAD_ADDRESS);
  IS(GCWritePort(o->port, width, &value, &size), BAD_ADDRESS);
  IS(GCReadPort(o->port, width, NULL, &size), BAD_PARAMETER);
  IS(GCReadPort(o->port, width, &value, NULL), BAD_PARAMETER);
  IS(GCWritePort(o->port, width, NULL, &size), BAD_PARAMETER);
  int64_t two[2];
  struct entry entries[3] = {{width, &two[0], 8}, {most, &two[1], 8}, {1, &value, 8}};
  size_t count = 2;
  IS(GCReadPortStacked(o->port, entries, &count), OK);
  MUST(two[0] == columns && two[1] == columns);
  count = 3;
  IS(GCReadPortStacked(o->port, entries, &count), BAD_ADDRESS);
  MUST(count == 2);
  count = 2;
  IS(GCWritePortStacked(o->port, entries, &count), DENIED);
  MUST(count == 1);
  IS(GCReadPortStacked(o->port, NULL, &count), BAD_PARAMETER);
}

static void buffers(struct open *o) {
  size_t bytes = payload(o->ds), size;
  H a, small, out;
  void *memory = malloc(bytes), *given;
  void *data[2];
  IS(DSStartAcquisition(o->ds, 0, 1), BAD_PARAMETER); /* no buffer yet */
  IS(DSStopAcquisition(o->ds, 0), IN_USE);
  IS(DSAnnounceBuffer(o->ds, NULL, bytes, NULL, &a), BAD_PARAMETER);
  IS(DSAnnounceBuffer(o->ds, memory, 0, NULL, &a), BAD_PARAMETER);
  IS(DSAnnounceBuffer(o->ds, memory, bytes, NULL, NULL), BAD_PARAMETER);
  IS(DSAllocAndAnnounceBuffer(o->ds, SIZE_MAX / 2, NULL, &a), -1021);
  IS(DSAnnounceBuffer(o->ds, memory, bytes, memory, &a), OK);
  IS(DSAllocAndAnnounceBuffer(o->ds, 10, NULL, &small), OK);
  IS(DSGetBufferID(o->ds, 0, &out), OK);
  IS(DSGetBufferID(o->ds, 2, &out), BAD_INDEX);
  IS(DSQueueBuffer(o->ds, a), OK);
  IS(DSQueueBuffer(o->ds, a), BUSY);
  IS(DSRevokeBuffer(o->ds, a, NULL, NULL), BUSY);
  IS(DSQueueBuffer(o->ds, small), OK);
  IS(DSFlushQueue(o->ds, 17), BAD_PARAMETER);
  size = sizeof data;
  IS(EventGetData(o->event, data, &size, 10), TIMEOUT);
  IS(DSStartAcquisition(o->ds, 0, 2), OK);
  IS(DSStartAcquisition(o->ds, 0, 2), IN_USE);
  IS(write_(o->port, "AcquisitionStart", 1), OK);
  IS(write_(o->port, "Width", 1), DENIED);
  size = 3;
  IS(EventGetData(o->event, data, &size, 10000), TOO_SMALL);
  IS(EventGetData(o->event, NULL, &size, 10), BAD_PARAMETER);
  size = sizeof data;
  IS(EventGetData(o->event, data, &size, 10000), OK);
  MUST(data[0] == a && data[1] == memory && size == sizeof data);
  IS(EventGetDataInfo(o->event, data, 3, 0, NULL, &given, &size), BAD_PARAMETER);
  IS(EventGetDataInfo(o->event, data, sizeof data, 0, NULL, &given, &size), OK);
  MUST(given == a);
  uint64_t frame = 0;
  size = sizeof frame;
  IS(DSGetBufferInfo(o->ds, a, 16, NULL, &frame, &size), OK);
  MUST(frame == 1);
  uint32_t parts = 0;
  IS(DSGetNumBufferParts(o->ds, a, &parts), OK);
  MUST(parts == 3);
  IS(DSGetBufferPartInfo(o->ds, a, 3, 1, NULL, &frame, &size), BAD_INDEX);
  IS(DSGetBufferInfo(o->ds, a, 20, NULL, &frame, &size), NOT_AVAILABLE);
  IS(DSGetBufferChunkData(o->ds, a, NULL, &size), NOT_AVAILABLE);
  /* A buffer that is too small says so and is not written beyond its end. */
  size = sizeof data;
  IS(EventGetData(o->event, data, &size, 10000), OK);
  MUST(data[0] == small);
  uint8_t larger = 0;
  size = 1;
  IS(DSGetBufferInfo(o->ds, small, 29, NULL, &larger, &size), OK);
  MUST(larger == 1);
  /* Two frames were asked for. */
  IS(DSQueueBuffer(o->ds, a), OK);
  size = sizeof data;
  IS(EventGetData(o->event, data, &size, 50), TIMEOUT);
  IS(write_(o->port, "AcquisitionStop", 1), OK);
  IS(DSStopAcquisition(o->ds, 1), OK);
  IS(DSStopAcquisition(o->ds, 1), IN_USE);
  IS(DSFlushQueue(o->ds, 0), OK);
  IS(DSRevokeBuffer(o->ds, a, NULL, NULL), BUSY);
  IS(DSFlushQueue(o->ds, 1), OK);
  IS(DSRevokeBuffer(o->ds, a, &given, NULL), OK);
  MUST(given == memory);
  IS(DSRevokeBuffer(o->ds, a, &given, NULL), BAD_HANDLE);
  free(memory);
}

static void kills(struct open *o) {
  struct waiter w[2] = {{o->event, 1}, {o->event, 1}};
  pthread_t threads[2];
  for (int k = 0; k < 2; k++) pthread_create(&threads[k], NULL, wait_for_data, &w[k]);
  usleep(20000);
  IS(EventKill(o->event), OK);
  IS(EventKill(o->event), OK);
  for (int k = 0; k < 2; k++) pthread_join(threads[k], NULL);
  MUST(w[0].result == ABORTED && w[1].result == ABORTED);
  /* The library goes while a thread waits. */
  pthread_create(&threads[0], NULL, wait_for_data, &w[0]);
  usleep(20000);
  IS(GCCloseLib(), OK);
  pthread_join(threads[0], NULL);
  /* On a busy machine the thread may have begun only after that. */
  MUST(w[0].result == ABORTED || w[0].result == BAD_HANDLE || w[0].result == NOT_INITIALIZED);
  IS(DSClose(o->ds), NOT_INITIALIZED);
}

static void misuse(int n) {
  for (int k = 0; k < n; k++) {
    struct open o;
    not_initialized();
    open_all(&o);
    sizes(&o);
    closed(&o);
    registers(&o);
    buffers(&o);
    kills(&o);
  }
}

int main(int count, char **words) {
  if (count != 4) return 2;
  /* A call that never comes back ends the program. */
  alarm(600);
  load(words[1]);
  int n = atoi(words[3]);
  if (!strcmp(words[2], "rounds")) rounds(n); else misuse(n);
  printf("%d failures\n", failures);
  return failures > 0;
}
