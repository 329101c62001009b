#include "programs/link/igtl_messages.h"

#include <fmt/format.h>
#include <igtlPolyDataMessage.h>
#include <igtlSensorMessage.h>
#include <igtlStringMessage.h>
#include <igtlTimeStamp.h>
#include <igtl_header.h>
#include <igtl_unit.h>
#include <igtl_util.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace palpate {
namespace {

constexpr double kFlip[3] = {-1, -1, 1};  // LPS <-> RAS
constexpr std::size_t kTransformBytes = 48, kExtendedHeaderBytes = 12;

std::uint64_t big_endian(const unsigned char* at, int bytes) {
  std::uint64_t value = 0;
  for (int i = 0; i < bytes; ++i) value = value << 8 | at[i];
  return value;
}

// A name ends at a zero or at the end of its field; a character that cannot be printed becomes '?'.
std::string printable(const char* field, std::size_t size) {
  std::string text(field, ::strnlen(field, size));
  for (char& c : text)
    if (c < ' ' || c > '~') c = '?';
  return text;
}

// The content between the extended header and the metadata of version 2.
bool strip_extension(std::span<const unsigned char>& body) {
  if (body.size() < kExtendedHeaderBytes) return false;
  const std::uint64_t head = big_endian(body.data(), 2), meta_head = big_endian(body.data() + 2, 2),
                      meta = big_endian(body.data() + 4, 4);
  if (head < kExtendedHeaderBytes || head + meta_head + meta > body.size()) return false;
  body = body.subspan(head, body.size() - head - meta_head - meta);
  return true;
}

// Twelve float32: the three columns of the turn, then the position, mm. Returns what is wrong, or nothing.
std::string read_pose(std::span<const unsigned char> content, ToolPose* pose) {
  if (content.size() != kTransformBytes)
    return fmt::format("expected {} bytes of content, found {}", kTransformBytes, content.size());
  double number[12];
  for (int i = 0; i < 12; ++i)
    number[i] = std::bit_cast<float>(static_cast<std::uint32_t>(big_endian(content.data() + 4 * i, 4)));
  if (!std::all_of(number, number + 12, [](double x) { return std::fabs(x) <= 1e8; }))  // false for NaN
    return "expected finite numbers, positions within 100 km";
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) pose->turn[r][c] = kFlip[r] * number[3 * c + r] * kFlip[c];
    pose->position[r] = kFlip[r] * number[9 + r] / 1000;
  }
  // R^T R must be 1 within a thousandth, which is more than the rounding of float32 and of trackers; no mirror.
  const Rotation& t = pose->turn;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b)
      if (!(std::fabs(t[0][a] * t[0][b] + t[1][a] * t[1][b] + t[2][a] * t[2][b] - (a == b)) <= 1e-3))
        return "expected a turn and a position, found a matrix that scales or shears";
  const double volume = t[0][0] * (t[1][1] * t[2][2] - t[1][2] * t[2][1]) -
                        t[0][1] * (t[1][0] * t[2][2] - t[1][2] * t[2][0]) +
                        t[0][2] * (t[1][0] * t[2][1] - t[1][1] * t[2][0]);
  return volume > 0 ? "" : "expected a turn and a position, found a mirror";
}

IgtlBytes bytes_of(igtl::MessageBase& message) {
  message.Pack();
  const auto* from = static_cast<const unsigned char*>(message.GetPackPointer());
  return {from, from + message.GetPackSize()};
}

void stamp(igtl::MessageBase& message, const std::string& device) {
  igtl::TimeStamp::Pointer time = igtl::TimeStamp::New();
  time->GetTime();
  message.SetTimeStamp(time);
  message.SetDeviceName(device.c_str());
}

}  // namespace

// Moves bytes into held_ until it has `wanted`. Returns whether it has.
bool IgtlStream::fill(std::span<const unsigned char>& bytes, std::size_t wanted) {
  const std::size_t count = std::min(bytes.size(), wanted - held_.size());
  held_.insert(held_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count));
  bytes = bytes.subspan(count);
  return held_.size() == wanted;
}

bool IgtlStream::next(std::span<const unsigned char>& bytes, IgtlRequest* request) {
  const auto skipped = static_cast<std::size_t>(std::min<std::uint64_t>(to_skip_, bytes.size()));
  bytes = bytes.subspan(skipped);
  to_skip_ -= skipped;
  if (to_skip_ > 0) return false;
  if (!has_header_) {
    if (!fill(bytes, IGTL_HEADER_SIZE)) return false;
    if (read_header(request)) return held_.clear(), true;
    has_header_ = true, held_.clear();
  }
  if (!fill(bytes, static_cast<std::size_t>(body_bytes_))) return false;
  read_body(request);
  has_header_ = false, held_.clear();
  return true;
}

// True where no body is needed: it is skipped, or the header is refused.
bool IgtlStream::read_header(IgtlRequest* request) {
  igtl_header header;
  std::memcpy(&header, held_.data(), IGTL_HEADER_SIZE);
  igtl_header_convert_byte_order(&header);
  version_ = header.version;
  request->type = type_ = printable(header.name, sizeof header.name);
  request->device = device_ = printable(header.device_name, sizeof header.device_name);
  body_bytes_ = header.body_size;
  crc_ = header.crc;
  const auto refuse = [&](const std::string& why) {
    request->kind = IgtlRequest::Kind::refused;
    request->refusal = why, request->closing = true;
    return true;
  };
  if (version_ != 1 && version_ != 2)
    return refuse(fmt::format("expected an OpenIGTLink header of version 1 or 2, found version {}", version_));
  static const char* const read[] = {"TRANSFORM", "GET_POLYDATA", "STT_POLYDATA", "STP_POLYDATA"};
  if (std::find(std::begin(read), std::end(read), type_) == std::end(read)) {
    to_skip_ = body_bytes_;
    return true;
  }
  if (body_bytes_ > kMostBody)
    return refuse(fmt::format("expected a {} of at most {} bytes, found {}", type_, kMostBody, body_bytes_));
  return false;
}

void IgtlStream::read_body(IgtlRequest* request) {
  request->type = type_, request->device = device_;
  const auto refuse = [&](const std::string& why) {
    request->kind = IgtlRequest::Kind::refused;
    request->refusal = fmt::format("{} of \"{}\": {}", type_, device_, why);
  };
  if (crc64(held_.data(), held_.size(), 0) != crc_) return refuse("its checksum does not fit its body");
  std::span<const unsigned char> content(held_);
  if (version_ == 2 && !strip_extension(content)) return refuse("its extended header does not fit its body");
  if (type_ == "TRANSFORM") {
    request->kind = IgtlRequest::Kind::pose;
    if (const std::string wrong = read_pose(content, &request->pose); !wrong.empty()) refuse(wrong);
  } else if (type_ == "GET_POLYDATA") {
    request->kind = IgtlRequest::Kind::get_surface;
  } else if (type_ == "STP_POLYDATA") {
    request->kind = IgtlRequest::Kind::stop_surface;
  } else {
    request->kind = IgtlRequest::Kind::start_surface;
    if (content.size() == 8)  // seconds and their fraction, 32 bits each
      request->interval = static_cast<double>(big_endian(content.data(), 8)) / 4294967296.0;
    else if (!content.empty())
      refuse(fmt::format("expected no content or 8 bytes, found {}", content.size()));
  }
}

struct SurfaceMessage::Parts {
  igtl::PolyDataMessage::Pointer message = igtl::PolyDataMessage::New();
  igtl::PolyDataPointArray::Pointer points = igtl::PolyDataPointArray::New();
  igtl::PolyDataCellArray::Pointer polygons = igtl::PolyDataCellArray::New();
  igtl::PolyDataAttribute::Pointer displacement = igtl::PolyDataAttribute::New();
  std::string device;
  int node_count = 0;
};

SurfaceMessage::SurfaceMessage(std::string device, const std::int32_t* triangles, int triangle_count, int node_count)
    : parts_(std::make_unique<Parts>()) {
  parts_->device = std::move(device);
  parts_->node_count = node_count;
  parts_->points->SetNumberOfPoints(node_count);
  for (int f = 0; f < triangle_count; ++f) {
    igtlUint32 corners[3];
    std::copy_n(triangles + 3 * static_cast<std::ptrdiff_t>(f), 3, corners);
    parts_->polygons->AddCell(3, corners);
  }
  parts_->displacement->SetType(igtl::PolyDataAttribute::POINT_VECTOR);
  parts_->displacement->SetName("displacement");
  parts_->displacement->SetSize(static_cast<igtlUint32>(node_count));
  parts_->message->SetPoints(parts_->points);
  parts_->message->SetPolygons(parts_->polygons);
  parts_->message->AddAttribute(parts_->displacement);
}

SurfaceMessage::~SurfaceMessage() = default;

IgtlBytes SurfaceMessage::pack(const float* positions, const float* displacements) {
  for (int n = 0; n < parts_->node_count; ++n) {
    float point[3], moved[3];
    for (int d = 0; d < 3; ++d) {
      point[d] = static_cast<float>(1000 * kFlip[d] * positions[3 * n + d]);
      moved[d] = static_cast<float>(1000 * kFlip[d] * displacements[3 * n + d]);
    }
    parts_->points->SetPoint(static_cast<unsigned>(n), point);
    parts_->displacement->SetNthData(static_cast<unsigned>(n), moved);
  }
  stamp(*parts_->message, parts_->device);
  return bytes_of(*parts_->message);
}

IgtlBytes force_message(const std::string& device, const double* force) {
  igtl::SensorMessage::Pointer message = igtl::SensorMessage::New();
  stamp(*message, device);
  igtl::Unit::Pointer unit = igtl::Unit::New();
  unit->Init();
  unit->SetPrefix(IGTL_UNIT_PREFIX_NONE);
  unit->Append(IGTL_UNIT_SI_DERIVED_NEWTON, 1);
  message->SetUnit(unit);
  message->SetLength(3);
  for (unsigned d = 0; d < 3; ++d) message->SetValue(d, kFlip[d] * force[d]);
  return bytes_of(*message);
}

IgtlBytes force_text_message(const std::string& device, const double* force) {
  igtl::StringMessage::Pointer message = igtl::StringMessage::New();
  stamp(*message, device);
  std::string text = fmt::format("{:.6g} {:.6g} {:.6g} N", kFlip[0] * force[0], kFlip[1] * force[1], force[2]);
  message->SetString(text);
  return bytes_of(*message);
}

IgtlBytes done_message(const std::string& device) {
  unsigned char done = 0;
  igtl_header header = {};
  header.version = 1;
  std::copy_n("RTS_POLYDATA", sizeof header.name, header.name);  // all twelve characters of the field
  std::copy_n(device.data(), std::min(device.size(), sizeof header.device_name), header.device_name);
  header.body_size = 1;
  header.crc = crc64(&done, 1, 0);
  igtl_header_convert_byte_order(&header);
  IgtlBytes bytes(IGTL_HEADER_SIZE + 1, done);
  std::memcpy(bytes.data(), &header, IGTL_HEADER_SIZE);
  return bytes;
}

}  // namespace palpate
