#include "formats/bundle_writer.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <utility>

#include "formats/bundle_reader.h"
#include "formats/checksum.h"
#include "formats/element_layout.h"
#include "formats/errors.h"

namespace palpate {

namespace {

using formats::ElementType;
using formats::SectionDescription;
using formats::SectionEntry;
using formats::SectionId;

// ---- HDF5 -----------------------------------------------------------------------------------------------------------

// The deepest message of HDF5's error stack, which names the cause.
herr_t keep_first_message(unsigned, const H5E_error2_t* entry, void* text) {
  auto& message = *static_cast<std::string*>(text);
  if (message.empty() && entry->desc) message = entry->desc;
  return 0;
}

// One HDF5 identifier, closed at the end of its scope.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close_it)(hid_t), const std::string& doing) : id_(id), close_(close_it) {
    if (id_ >= 0) return;
    std::string reason;
    H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keep_first_message, &reason);
    throw OperationError(fmt::format("HDF5 failed at {}: {}", doing, reason));
  }
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle& operator=(Handle&&) = delete;
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  // For the file, whose closing writes and can fail.
  herr_t close() {
    const herr_t result = close_(id_);
    id_ = -1;
    return result;
  }
  operator hid_t() const { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

void require(herr_t result, const std::string& doing) {
  if (result >= 0) return;
  std::string reason;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keep_first_message, &reason);
  throw OperationError(fmt::format("HDF5 failed at {}: {}", doing, reason));
}

// HDF5 prints its error stack to stderr unless told not to; ours is the one sentence.
class QuietHdf5 {
 public:
  QuietHdf5() {
    H5Eget_auto2(H5E_DEFAULT, &print_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~QuietHdf5() { H5Eset_auto2(H5E_DEFAULT, print_, data_); }
  QuietHdf5(const QuietHdf5&) = delete;
  QuietHdf5& operator=(const QuietHdf5&) = delete;

 private:
  H5E_auto2_t print_ = nullptr;
  void* data_ = nullptr;
};

Handle text_type(std::size_t bytes) {
  Handle type(H5Tcopy(H5T_C_S1), &H5Tclose, "a string type");
  require(H5Tset_size(type, bytes), "a string's size");
  require(H5Tset_cset(type, H5T_CSET_UTF8), "a string's character set");
  require(H5Tset_strpad(type, H5T_STR_NULLPAD), "a string's padding");
  return type;
}

// HDF5 has no boolean type; h5py reads this enumeration as bool.
Handle truth_type() {
  Handle type(H5Tenum_create(H5T_STD_I8LE), &H5Tclose, "a type for true and false");
  const std::int8_t no = 0, yes = 1;
  require(H5Tenum_insert(type, "FALSE", &no), "the value false");
  require(H5Tenum_insert(type, "TRUE", &yes), "the value true");
  return type;
}

void write_attribute(hid_t object, const std::string& name, hid_t type, const void* value) {
  const Handle space(H5Screate(H5S_SCALAR), &H5Sclose, "a scalar");
  const Handle attribute(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT), &H5Aclose,
                         "attribute " + name);
  require(H5Awrite(attribute, type, value), "attribute " + name);
}

void write_text_attribute(hid_t object, const std::string& name, const std::string& value) {
  // Variable length, so that Python reads str and not bytes.
  const Handle type = text_type(H5T_VARIABLE);
  const char* text = value.c_str();
  write_attribute(object, name, type, &text);
}

void write_json_attribute(hid_t object, const std::string& name, const nlohmann::json& value) {
  if (value.is_string()) return write_text_attribute(object, name, value.get<std::string>());
  if (value.is_boolean()) {
    const std::int8_t truth = value.get<bool>() ? 1 : 0;
    return write_attribute(object, name, truth_type(), &truth);
  }
  if (value.is_number_integer() && (!value.is_number_unsigned() || value.get<std::uint64_t>() <= INT64_MAX)) {
    const auto number = value.get<std::int64_t>();
    return write_attribute(object, name, H5T_STD_I64LE, &number);
  }
  if (value.is_number()) {
    const auto number = value.get<double>();
    return write_attribute(object, name, H5T_IEEE_F64LE, &number);
  }
  throw InputError(
      fmt::format("provenance: expected a string, number or boolean for {}, found {}", name, value.dump()));
}

// These attributes are also on the group certificate, beside its datasets.
constexpr const char* kCertificateKeys[] = {
    "solver",     "tolerance",      "element",        "worst_residual",       "most_iterations", "reciprocity_error",
    "cast_error", "element_probes", "element_excess", "element_excess_median"};

Handle open_certificate(hid_t file) {
  return Handle(H5Gopen2(file, "certificate", H5P_DEFAULT), &H5Gclose, "group certificate");
}

// In place: the attribute keeps its type and its bytes in the file.
void replace_number(hid_t object, const std::string& name, const nlohmann::json& value) {
  const Handle attribute(H5Aopen(object, name.c_str(), H5P_DEFAULT), &H5Aclose, "attribute " + name);
  const Handle type(H5Aget_type(attribute), &H5Tclose, "the type of attribute " + name);
  if ((H5Tget_class(type) == H5T_INTEGER) != value.is_number_integer())
    throw InputError(
        fmt::format("provenance: expected a number of the same kind for {}, found {}", name, value.dump()));
  const auto whole = value.is_number_integer() ? value.get<std::int64_t>() : 0;
  const double number = value.get<double>();
  const void* bytes = value.is_number_integer() ? static_cast<const void*>(&whole) : &number;
  require(H5Awrite(attribute, type, bytes), "attribute " + name);
}

void finish_certificate(hid_t file, const nlohmann::json& provenance) {
  const Handle certificate = open_certificate(file);
  for (const char* key : kCertificateKeys)
    if (provenance.contains(key) && provenance[key].is_number()) replace_number(certificate, key, provenance[key]);
}

nlohmann::json parse_provenance(const std::string& text) {
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object()) throw InputError("provenance: expected one JSON object, found " + text.substr(0, 80));
  return json;
}

// Opens every group on the way to a dataset, making those that are not there, without times.
void make_groups(hid_t file, const std::string& path, hid_t group_properties) {
  for (std::size_t slash = path.find('/'); slash != std::string::npos; slash = path.find('/', slash + 1)) {
    const std::string group = path.substr(0, slash);
    if (H5Lexists(file, group.c_str(), H5P_DEFAULT) > 0) continue;
    const Handle made(H5Gcreate2(file, group.c_str(), H5P_DEFAULT, group_properties, H5P_DEFAULT), &H5Gclose,
                      "group " + group);
  }
}

// ---- sections -------------------------------------------------------------------------------------------------------

const SectionDescription& description_of(SectionId id) {
  const SectionDescription* section = formats::describe_section(id);
  if (!section)
    throw InputError(fmt::format("section {}: is not in bundle_sections.def", static_cast<std::uint32_t>(id)));
  return *section;
}

// The type asked for, or the only one the list offers. Errors: InputError.
ElementType type_of(const SectionShape& section, const SectionDescription& description) {
  if (!section.type && std::has_single_bit(description.types))
    return static_cast<ElementType>(std::countr_zero(description.types));
  if (!section.type || !formats::may_have(description, static_cast<std::uint32_t>(*section.type)))
    throw InputError(
        fmt::format("{}: expected one of the element types that bundle_sections.def lists for it", description.path));
  return *section.type;
}

// The entry of a section that has no offset yet. Errors: InputError.
SectionEntry entry_of(const SectionShape& section) {
  const SectionDescription& description = description_of(section.id);
  if (section.shape.size() != description.rank)
    throw InputError(fmt::format("{}: expected a shape of rank {} {}, found rank {}", description.path,
                                 description.rank, description.shape, section.shape.size()));
  SectionEntry entry{};
  entry.id = static_cast<std::uint32_t>(section.id);
  const ElementType type = type_of(section, description);
  entry.type = static_cast<std::uint32_t>(type);
  entry.rank = description.rank;
  entry.bytes = formats::element_bytes(type);
  std::fill(std::begin(entry.shape), std::end(entry.shape), 1);
  for (std::size_t d = 0; d < section.shape.size(); ++d) {
    const std::uint64_t length = section.shape[d];
    if (length == 0 || length > INT32_MAX || entry.bytes > INT64_MAX / length)
      throw InputError(
          fmt::format("{}: dimension {} has length {}, which a bundle cannot hold", description.path, d, length));
    entry.shape[d] = length;
    entry.bytes *= length;
  }
  return entry;
}

// IEEE half: HDF5 1.10 has no name for it; h5py reads this as float16.
Handle half_type() {
  Handle type(H5Tcopy(H5T_IEEE_F32LE), &H5Tclose, "a half-precision type");
  require(H5Tset_fields(type, 15, 10, 5, 0, 10), "a half's fields");
  require(H5Tset_size(type, 2), "a half's size");
  require(H5Tset_ebias(type, 15), "a half's exponent");
  return type;
}

// The HDF5 type that gives the natural reading of numbers.
Handle number_type(ElementType type) {
  if (type == ElementType::f16) return half_type();
  const hid_t known = type == ElementType::f64   ? H5T_IEEE_F64LE
                      : type == ElementType::f32 ? H5T_IEEE_F32LE
                      : type == ElementType::i32 ? H5T_STD_I32LE
                                                 : H5T_STD_U8LE;
  return Handle(H5Tcopy(known), &H5Tclose, "a number type");
}

Handle create_dataset(hid_t file, const SectionEntry& entry, const SectionDescription& section, hid_t properties) {
  const std::string doing = std::string("dataset ") + section.path;
  const auto element = static_cast<ElementType>(entry.type);
  if (element == ElementType::text) {
    const Handle type = text_type(entry.bytes);
    const Handle space(H5Screate(H5S_SCALAR), &H5Sclose, doing);
    return Handle(H5Dcreate2(file, section.path, type, space, H5P_DEFAULT, properties, H5P_DEFAULT), &H5Dclose, doing);
  }
  hsize_t shape[formats::kMaxRank];
  std::copy(std::begin(entry.shape), std::end(entry.shape), shape);
  const Handle space(H5Screate_simple(static_cast<int>(entry.rank), shape, nullptr), &H5Sclose, doing);
  return Handle(H5Dcreate2(file, section.path, number_type(element), space, H5P_DEFAULT, properties, H5P_DEFAULT),
                &H5Dclose, doing);
}

// Creates the dataset with its unit and meaning and fills the entry's offset.
void lay_out_section(hid_t file, SectionEntry& entry, hid_t dataset_properties, hid_t group_properties) {
  const SectionDescription& section = description_of(static_cast<SectionId>(entry.id));
  make_groups(file, section.path, group_properties);
  const Handle dataset = create_dataset(file, entry, section, dataset_properties);
  write_text_attribute(dataset, "unit", section.unit);
  write_text_attribute(dataset, "meaning", section.meaning);
  write_text_attribute(dataset, "shape", section.shape);
  const haddr_t offset = H5Dget_offset(dataset);  // counts from the start of the file, user block included
  if (offset == HADDR_UNDEF || offset % formats::kSectionAlignment != 0 || offset < formats::kUserBlockBytes)
    throw OperationError(fmt::format("HDF5 placed {} at byte {}, not at a multiple of {}", section.path, offset,
                                     formats::kSectionAlignment));
  entry.offset = offset;
}

// Creates, lays out and closes the HDF5 file.
void create_file(const std::string& file, std::vector<SectionEntry>& entries, const nlohmann::json& provenance) {
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), &H5Pclose, "file access");
  require(H5Pset_alignment(access, 1, formats::kSectionAlignment), "the alignment");
  // A fixed format version: the same bytes from every later HDF5, readable by every HDF5 since 1.8.
  require(H5Pset_libver_bounds(access, H5F_LIBVER_V18, H5F_LIBVER_V18), "the format version");
  const Handle creation(H5Pcreate(H5P_FILE_CREATE), &H5Pclose, "file creation");
  require(H5Pset_userblock(creation, formats::kUserBlockBytes), "the user block");
  require(H5Pset_obj_track_times(creation, false), "the root group's times");
  const Handle group_properties(H5Pcreate(H5P_GROUP_CREATE), &H5Pclose, "group creation");
  require(H5Pset_obj_track_times(group_properties, false), "a group's times");
  const Handle dataset_properties(H5Pcreate(H5P_DATASET_CREATE), &H5Pclose, "dataset creation");
  require(H5Pset_obj_track_times(dataset_properties, false), "a dataset's times");
  require(H5Pset_layout(dataset_properties, H5D_CONTIGUOUS), "the contiguous layout");
  require(H5Pset_alloc_time(dataset_properties, H5D_ALLOC_TIME_EARLY), "early allocation");
  require(H5Pset_fill_time(dataset_properties, H5D_FILL_TIME_NEVER), "no filling");

  Handle handle(H5Fcreate(file.c_str(), H5F_ACC_TRUNC, creation, access), &H5Fclose, "creating the file");
  for (const auto& [name, value] : provenance.items()) write_json_attribute(handle, name, value);
  for (SectionEntry& entry : entries) lay_out_section(handle, entry, dataset_properties, group_properties);
  if (H5Lexists(handle, "certificate", H5P_DEFAULT) > 0) {
    const Handle certificate = open_certificate(handle);
    for (const char* key : kCertificateKeys)
      if (provenance.contains(key)) write_json_attribute(certificate, key, provenance[key]);
  }
  require(handle.close(), "closing the file");
}

// ---- plain files ----------------------------------------------------------------------------------------------------

std::uint64_t checksum_of(const PlainFile& file, const SectionEntry& entry, std::vector<char>& buffer,
                          const SectionReader& also) {
  formats::Xxh64 checksum;
  for (std::uint64_t done = 0; done < entry.bytes;) {
    const auto wanted = std::min<std::uint64_t>(buffer.size(), entry.bytes - done);
    if (file.read(entry.offset + done, buffer.data(), wanted) < wanted)
      throw OperationError(fmt::format("{}: ends inside section {}", file.path().string(), entry.id));
    checksum.update(buffer.data(), static_cast<std::size_t>(wanted));
    if (also) also(entry, done, buffer.data(), static_cast<std::size_t>(wanted));
    done += wanted;
  }
  return checksum.digest();
}

}  // namespace

std::vector<SectionEntry> lay_out_bundle(const std::filesystem::path& file, const std::vector<SectionShape>& sections,
                                         const std::string& provenance_json) {
  const nlohmann::json provenance = parse_provenance(provenance_json);
  std::vector<SectionEntry> entries;
  std::set<SectionId> seen;
  for (const SectionShape& section : sections) {
    entries.push_back(entry_of(section));
    if (!seen.insert(section.id).second)
      throw InputError(fmt::format("{}: is listed twice", description_of(section.id).path));
  }
  if (!seen.count(SectionId::provenance))
    entries.push_back(entry_of({SectionId::provenance, {provenance_json.size()}}));
  if (entries.size() > formats::kMaxSections)
    throw InputError(fmt::format("expected at most {} sections, found {}", formats::kMaxSections, entries.size()));

  {
    const QuietHdf5 quiet;
    try {
      create_file(file.string(), entries, provenance);
    } catch (const OperationError& error) {
      throw OperationError(fmt::format("{}: {}", file.string(), error.what()));
    }
  }
  SectionWriter writer(file);
  for (const SectionEntry& entry : entries)
    if (entry.id == static_cast<std::uint32_t>(SectionId::provenance)) {
      if (entry.bytes != provenance_json.size())
        throw InputError(
            fmt::format("provenance: expected {} bytes, found shape ({})", provenance_json.size(), entry.bytes));
      writer.write(entry, 0, provenance_json.data(), entry.bytes);
    }
  return entries;
}

void finish_provenance(const std::filesystem::path& file, const std::vector<SectionEntry>& entries,
                       const std::string& provenance_json) {
  const nlohmann::json provenance = parse_provenance(provenance_json);
  const auto entry = std::find_if(entries.begin(), entries.end(), [](const SectionEntry& e) {
    return e.id == static_cast<std::uint32_t>(SectionId::provenance);
  });
  if (entry == entries.end() || provenance_json.size() > entry->bytes)
    throw InputError(fmt::format("provenance: {} bytes do not fit the room it was given", provenance_json.size()));
  {
    const QuietHdf5 quiet;
    try {
      Handle handle(H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), &H5Fclose, "opening the file");
      for (const auto& [name, value] : provenance.items())
        if (value.is_number()) replace_number(handle, name, value);
      finish_certificate(handle, provenance);
      require(handle.close(), "closing the file");
    } catch (const OperationError& error) {
      throw OperationError(fmt::format("{}: {}", file.string(), error.what()));
    }
  }
  std::string text = provenance_json;
  text.resize(entry->bytes, ' ');
  SectionWriter(file).write(*entry, 0, text.data(), text.size());
}

const SectionEntry& entry_of(const std::vector<SectionEntry>& entries, SectionId id) {
  for (const auto& entry : entries)
    if (entry.id == static_cast<std::uint32_t>(id)) return entry;
  throw std::logic_error(fmt::format("section {} was not laid out", static_cast<std::uint32_t>(id)));
}

SectionWriter::SectionWriter(const std::filesystem::path& file) : file_(file, O_WRONLY) {}

void SectionWriter::write(const SectionEntry& entry, std::uint64_t first_byte, const void* bytes, std::uint64_t count) {
  if (first_byte > entry.bytes || count > entry.bytes - first_byte)
    throw std::logic_error(
        fmt::format("section {} has {} bytes; tried to write {} at {}", entry.id, entry.bytes, count, first_byte));
  file_.write(entry.offset + first_byte, bytes, count);
}

void SectionWriter::sync() {
  file_.sync_data();
}

namespace {

std::uint32_t layout_of(const PlainFile& file, const std::vector<SectionEntry>& entries) {
  for (const SectionEntry& entry : entries)
    if (entry.id == static_cast<std::uint32_t>(SectionId::provenance)) {
      std::string text(entry.bytes, ' ');
      file.read(entry.offset, text.data(), text.size());
      const nlohmann::json provenance = nlohmann::json::parse(text, nullptr, false);
      if (provenance.is_object() && provenance.contains("element") && provenance["element"].is_string())
        return formats::layout_of_element(provenance["element"].get<std::string>());
    }
  return formats::kLayoutVersion;
}

}  // namespace

void seal_bundle(const std::filesystem::path& path, std::vector<SectionEntry> entries, const SectionReader& also) {
  if (entries.size() > formats::kMaxSections) throw std::logic_error("more sections than a bundle can hold");
  const PlainFile file(path, O_RDWR);
  std::vector<char> buffer(1 << 20);
  for (SectionEntry& entry : entries) entry.checksum = checksum_of(file, entry, buffer, also);

  formats::BundleHeader header{};
  std::memcpy(header.magic, formats::kBundleMagic, sizeof header.magic);
  header.layout_version = layout_of(file, entries);
  header.section_count = static_cast<std::uint32_t>(entries.size());
  header.file_bytes = file.size();
  header.user_block_bytes = formats::kUserBlockBytes;
  formats::Xxh64 checksum;
  checksum.update(&header, sizeof header);
  checksum.update(entries.data(), entries.size() * sizeof(SectionEntry));
  header.index_checksum = checksum.digest();

  std::vector<char> block(formats::kUserBlockBytes, 0);
  std::memcpy(block.data(), &header, sizeof header);
  std::memcpy(block.data() + sizeof header, entries.data(), entries.size() * sizeof(SectionEntry));

  // The reader must accept what was written.
  formats::BundleIndex index;
  formats::BundleError error;
  if (formats::read_bundle_index(block.data(), header.file_bytes, &index, &error) != formats::BundleStatus::ok)
    throw OperationError(fmt::format("{}: the bundle does not hold together: {}", path.string(), error.text));

  // Sections first, index last: a bundle with an index is complete even after a power cut.
  file.sync();
  file.write(0, block.data(), block.size());
  file.sync();
}

}  // namespace palpate
