// SPDX-License-Identifier: Apache-2.0
#include "map/versions.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iterator>
#include <set>

#include "common/program.h"
#include "common/text.h"
#include "map/site.h"
#include "output/replace_file.h"
#include "waymark/floors.h"

namespace wm::tools {
namespace {

namespace fs = std::filesystem;
constexpr char kRecord[] = "version.yaml";
constexpr char kStaged[] = ".new", kGone[] = ".gone";  // folders in versions/ that a killed program may leave
// A file there: the new version's name, and the changed files with their hashes before. It is there from before the
// version is current until the site's own files have its changes.
constexpr char kCarried[] = ".carried";

struct Descriptor {
  int fd;
  explicit Descriptor(int of) : fd(of) {}
  ~Descriptor() {
    if (fd >= 0) (void)close(fd);
  }
  Descriptor(const Descriptor &) = delete;
  Descriptor &operator=(const Descriptor &) = delete;
};

// A file or a folder's names, to the disk.
void sync(const fs::path &path) {
  const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.fd < 0 || fsync(file.fd) != 0)
    throw Failure(path.string() + ": can't be written to the disk: " + std::strerror(errno));
}

// One program at a time: held until it is destroyed, or its program ends.
class Lock {
 public:
  explicit Lock(const fs::path &site) : folder_(made(site)) {
    if (folder_.fd < 0) throw Failure(site.string() + "/versions: can't be opened: " + std::strerror(errno));
    if (flock(folder_.fd, LOCK_EX | LOCK_NB) != 0)
      throw Failure(site.string() + ": another program changes its versions just now; try again when it is done");
    carry(site);
    clean(site);
  }
  Lock(const Lock &) = delete;
  Lock &operator=(const Lock &) = delete;

  // What was left over.
  static void clean(const fs::path &site) {
    for (const auto &entry : fs::directory_iterator(site / "versions"))
      if (entry.path().filename().string().rfind('.', 0) == 0) fs::remove_all(entry.path());
  }
  static void carry(const fs::path &site);

 private:
  static int made(const fs::path &site) {
    fs::create_directory(site / "versions");
    return open((site / "versions").c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  }
  Descriptor folder_;
};

struct Record : wm_map_version {
  Record() : wm_map_version{} {}
  ~Record() { std::free(files); }
  Record(const Record &) = delete;
  Record &operator=(const Record &) = delete;
};

std::string current_of(const fs::path &site) {
  char name[WM_MAP_VERSION_NAME];
  wm_error error{};
  need_ok(wm_map_version_current(site.c_str(), name, &error), error);
  return name;
}

uint64_t hash_of(const fs::path &file) {
  wm_error error{};
  uint64_t out = 0;
  need_ok(wm_file_hash(file.c_str(), &out, &error), error);
  return out;
}

uint64_t hash_if_there(const fs::path &file) { return fs::exists(file) ? hash_of(file) : 0; }

struct Draft {
  std::vector<wm_map_version_file> files;
  std::string name;
};

Draft draft_of(const fs::path &site) {
  Draft out;
  for (const std::string &below : files_of(*read_floors(site))) {
    wm_map_version_file file{};
    if (below.size() >= sizeof file.path) throw Failure(below + ": the path is too long");
    std::memcpy(file.path, below.c_str(), below.size() + 1);
    file.hash = hash_of(site / below);
    out.files.push_back(file);
  }
  wm_map_version version{};
  version.files = out.files.data();
  version.file_count = out.files.size();
  char name[WM_MAP_VERSION_NAME];
  wm_map_version_name(&version, name);
  out.name = name;
  return out;
}

// A robot's copy may have versions alone.
bool has_files(const fs::path &site) {
  wm_floors *floors = nullptr;
  const bool has = wm_floors_read(site.c_str(), &floors, nullptr) != WM_NOT_FOUND;
  std::free(floors);
  return has;
}

std::string utc_now() {
  char out[24];
  timespec now{};
  tm parts{};
  (void)clock_gettime(CLOCK_REALTIME, &now);
  (void)gmtime_r(&now.tv_sec, &parts);
  (void)strftime(out, sizeof out, "%Y-%m-%dT%H:%M:%S", &parts);
  return out + text(".%03ldZ", now.tv_nsec / 1000000);
}

std::string quoted(const std::string &value) {
  std::string out = "\"";
  for (const char c : value) {
    if (static_cast<unsigned char>(c) < ' ' || c == '\x7f') continue;
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

std::string record_text(const Draft &draft, const std::string &base, const std::string &author,
                        const std::string &note) {
  std::string out = "format: waymark-site-version/1\n";
  if (!base.empty()) out += "base: \"" + base + "\"\n";
  out += "date: \"" + utc_now() + "\"\nauthor: " + quoted(author) + "\n";
  if (!note.empty()) out += "note: " + quoted(note) + "\n";
  out += "files:\n";
  for (const wm_map_version_file &file : draft.files)
    out += "  " + quoted(file.path) + text(": \"%016" PRIx64 "\"\n", file.hash);
  return out + text("# seal %016" PRIx64 "\n", wm_map_version_seal(out.data(), out.size()));
}

void write_through(const fs::path &path, const std::string &bytes) {
  wm_error error{};
  const file_part part{bytes.data(), bytes.size()};
  need_ok(replace_file(path.c_str(), &part, 1, &error), error);
}

void set_current(const fs::path &site, const std::string &name) {
  write_through(site / "versions/current", name + "\n");
}

// A file of the folder `from` into the staged one: by a link where the base, a version of the site, has the same file,
// else a copy. True where it is shared.
bool stage(const fs::path &from, const wm_map_version_file &file, const fs::path &site, const wm_map_version &base,
           const fs::path &staged) {
  const fs::path to = staged / file.path;
  fs::create_directories(to.parent_path());
  const bool is_there = std::any_of(base.files, base.files + base.file_count, [&](const wm_map_version_file &other) {
    return other.hash == file.hash && std::strcmp(other.path, file.path) == 0;
  });
  std::error_code no_link;
  if (is_there) fs::create_hard_link(site / "versions" / base.name / file.path, to, no_link);
  if (is_there && !no_link) return true;
  fs::copy_file(from / file.path, to);
  if (hash_of(to) != file.hash)
    throw Failure((from / file.path).string() + ": was changed while the version was made; make it again");
  sync(to);
  return false;
}

void sync_folders(const fs::path &staged) {
  for (const auto &entry : fs::recursive_directory_iterator(staged))
    if (entry.is_directory()) sync(entry.path());
  sync(staged);
}

// A staged folder becomes a version.
void put_in_place(const fs::path &site, const fs::path &staged, const std::string &name) {
  const fs::path version = site / "versions" / name;
  sync_folders(staged);
  if (const int problem = rename_through(staged.c_str(), version.c_str()); problem != 0)
    throw Failure(version.string() + ": can't be written: " + std::strerror(problem));
  sync(site);
}

// Never half of it is there under its name.
void remove_one(const fs::path &site, const std::string &name) {
  const fs::path gone = site / "versions" / (kGone + name);
  fs::rename(site / "versions" / name, gone);
  fs::remove_all(gone);
}

// Begins with `begin`.
std::vector<std::string> names_of(const fs::path &site, const std::string &begin = "") {
  std::vector<std::string> out;
  if (!fs::is_directory(site / "versions")) return out;
  for (const auto &entry : fs::directory_iterator(site / "versions"))
    if (const std::string name = entry.path().filename(); entry.is_directory() && name[0] != '.')
      if (name.rfind(begin, 0) == 0) out.push_back(name);
  std::sort(out.begin(), out.end());
  return out;
}

// The one that begins so.
std::string one_name_of(const fs::path &site, const std::string &begin) {
  const std::vector<std::string> found = names_of(site, begin);
  if (found.empty())
    throw Failure(site.string() + ": has no version " + begin + "; `waymark map version " + site.string() + " --list`",
                  kUsage);
  if (found.size() > 1) throw Failure(begin + ": " + std::to_string(found.size()) + " versions begin so", kUsage);
  return found.front();
}

void need_sound(const fs::path &site, const std::string &name, Record *out) {
  wm_error error{};
  need_ok(wm_map_version_read(site.c_str(), name.c_str(), out, &error), error);
}

// `staged` is what becomes a version; messages name the files of `site`.
void need_good(const fs::path &site, const fs::path &staged) {
  const SiteReport report = check_floors(staged);
  if (report.wrong.empty()) return;
  std::string lines = site.string() + ": no version is made, as robots could not use it:";
  for (std::string line : report.wrong) {
    for (size_t at = 0; (at = line.find(staged.string(), at)) != std::string::npos; at += site.string().size())
      line.replace(at, staged.string().size(), site.string());
    lines += "\n  " + line;
  }
  throw Failure(lines);
}

// All files of the site, with the changes; returns how many are shared with the base.
size_t stage_all(const fs::path &site, const Draft &draft, const FileChanges &changes, const wm_map_version &base,
                 const fs::path &staged) {
  size_t shared = 0;
  fs::create_directory(staged);
  for (const wm_map_version_file &file : draft.files)
    if (changes.count(file.path) == 0) shared += stage(site, file, site, base, staged) ? 1 : 0;
  for (const auto &[path, bytes] : changes) {
    if (!bytes) continue;
    fs::create_directories((staged / path).parent_path());
    write_through(staged / path, *bytes);
  }
  return shared;
}

std::string carried_text(const fs::path &site, const std::string &name, const FileChanges &changes) {
  std::string out = name + "\n";
  for (const auto &[path, bytes] : changes) out += text("%016" PRIx64 " ", hash_if_there(site / path)) + path + "\n";
  return out;
}

// A person may have edited a file since: it stays then.
void Lock::carry(const fs::path &site) {
  const fs::path list = site / "versions" / kCarried;
  std::ifstream file(list);
  std::string name, line;
  if (!std::getline(file, name) || name != current_of(site)) return;
  while (std::getline(file, line)) {
    uint64_t before = 0;
    int path_at = 0;
    if (std::sscanf(line.c_str(), "%16" SCNx64 " %n", &before, &path_at) != 1 || path_at != 17)
      throw Failure(list.string() + ": is damaged; remove it, and compare the site's files with version " + name);
    const fs::path to = site / line.substr(17), from = site / "versions" / name / line.substr(17);
    if (hash_if_there(to) != before) continue;
    if (!fs::exists(from)) {
      fs::remove(to);
      continue;
    }
    std::ifstream in(from, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    if (!in) throw Failure(from.string() + ": can't be read");
    write_through(to, bytes);
  }
}

}  // namespace

std::vector<VersionListed> list_versions(const fs::path &site) {
  std::vector<VersionListed> out;
  std::string current, damage;
  try {
    current = current_of(site);
  } catch (const Failure &failure) {
    damage = failure.what();
  }
  for (const std::string &name : names_of(site)) {
    Record record;
    wm_error error{};
    const bool is_sound = wm_map_version_read(site.c_str(), name.c_str(), &record, &error) == WM_OK;
    out.push_back({name, record.base, record.date, record.author, record.note, record.file_count, name == current,
                   is_sound ? "" : error.text});
  }
  const auto is_listed = [&](const VersionListed &v) { return v.is_current; };
  if (damage.empty() && !current.empty() && std::none_of(out.begin(), out.end(), is_listed))
    damage = site.string() + "/versions/current: names " + current + ", which is not there; take another one (--use)";
  std::sort(out.begin(), out.end(), [](const VersionListed &a, const VersionListed &b) {
    return a.date != b.date ? a.date < b.date : a.name < b.name;
  });
  if (!damage.empty()) out.push_back({"current", "", "", "", "", 0, true, damage});
  return out;
}

std::string version_line(const VersionListed &v) {
  return text("%s version %s  %s  %s, %zu files%s%s%s%s", v.is_current ? "*" : " ", v.name.c_str(), v.date.c_str(),
              v.author.c_str(), v.files, v.base.empty() ? "" : ", base ", v.base.c_str(), v.note.empty() ? "" : ": ",
              v.note.c_str());
}

std::string draft_against_current(const fs::path &site) {
  const std::string current = current_of(site);
  if (current.empty() || !has_files(site) || draft_of(site).name == current) return "";
  return site.string() + ": its files differ from the current version, which robots take; `waymark map version " +
         site.string() + "` makes a version of them";
}

std::string site_hash(const fs::path &site) { return draft_of(site).name; }

OutdatedBase::OutdatedBase(const fs::path &site, const std::string &base)
    : Failure(site.string() + ": is no longer as it was (" + base + "): another version was saved, or a file edited") {}

void finish_version(const fs::path &site) {
  if (!fs::exists(site / "versions" / kCarried)) return;
  const Lock lock(site);
}

MadeVersion make_version(const fs::path &site, const VersionWish &wish) {
  if (wish.author.size() >= sizeof Record{}.author || wish.note.size() >= sizeof Record{}.note)
    throw Failure(text("author and note of a version have at most %zu and %zu bytes", sizeof Record{}.author - 1,
                       sizeof Record{}.note - 1),
                  kUsage);
  const Lock lock(site);
  const Draft before = draft_of(site);
  if (!wish.base.empty() && wish.base != before.name) throw OutdatedBase(site, wish.base);
  const fs::path versions = site / "versions", staged = versions / kStaged;
  Record base;
  if (const std::string current = current_of(site); !current.empty()) need_sound(site, current, &base);
  MadeVersion out;
  try {
    out.shared = stage_all(site, before, wish.changes, base, staged);
    need_good(site, staged);
    const Draft draft = draft_of(staged);
    out.name = draft.name;
    out.files = draft.files.size();
    out.is_new = !fs::exists(versions / draft.name);
    if (out.is_new) {
      write_through(staged / kRecord, record_text(draft, base.name, wish.author, wish.note));
      put_in_place(site, staged, draft.name);
    } else {
      Record again;
      need_sound(site, draft.name, &again);
    }
    if (!wish.changes.empty()) write_through(versions / kCarried, carried_text(site, out.name, wish.changes));
    set_current(site, out.name);
    Lock::carry(site);
  } catch (...) {
    if (out.name.empty() || current_of(site) != out.name) Lock::clean(site);  // else the next program carries the rest
    throw;
  }
  Lock::clean(site);
  return out;
}

std::string use_version(const fs::path &site, const std::string &begin) {
  std::string name = one_name_of(site, begin);
  const Lock lock(site);
  Record record;
  need_sound(site, name, &record);
  set_current(site, name);
  return name;
}

std::string add_version(const fs::path &site, const fs::path &version) {
  const fs::path from = fs::absolute(version / ".").lexically_normal().parent_path(), versions = site / "versions";
  std::string name = from.filename();
  if (from.parent_path().filename() != "versions")
    throw Failure(version.string() + ": is no version's folder; .../versions/NAME is needed", kUsage);
  Record record, base;
  need_sound(from.parent_path().parent_path(), name, &record);
  const Lock lock(site);
  if (fs::exists(versions / name)) throw Failure(site.string() + ": has version " + name + " already");
  wm_error damage{};  // of the current version: it shares no files then
  if (const std::string current = current_of(site);
      !current.empty() && wm_map_version_read(site.c_str(), current.c_str(), &base, &damage) != WM_OK)
    base.file_count = 0;
  const fs::path staged = versions / kStaged;
  try {
    fs::create_directory(staged);
    for (size_t i = 0; i < record.file_count; i++) (void)stage(from, record.files[i], site, base, staged);
    fs::copy_file(from / kRecord, staged / kRecord);
    sync(staged / kRecord);
    need_good(from, staged);
    put_in_place(site, staged, name);
  } catch (...) {
    Lock::clean(site);
    throw;
  }
  return name;
}

std::string remove_version(const fs::path &site, const std::string &begin) {
  std::string name = one_name_of(site, begin);
  const Lock lock(site);
  if (name == current_of(site))
    throw Failure(site.string() + ": version " + name + " is the one that robots take; take another one first (--use)");
  remove_one(site, name);
  return name;
}

std::vector<std::string> collect_versions(const fs::path &site, size_t keep) {
  const Lock lock(site);
  const std::vector<VersionListed> all = list_versions(site);
  std::vector<std::string> out;
  for (size_t i = 0; i + keep < all.size(); i++) {
    if (all[i].is_current) continue;
    remove_one(site, all[i].name);
    out.push_back(all[i].name);
  }
  return out;
}

}  // namespace wm::tools
