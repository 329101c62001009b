// OpenIGTLink messages: reads those of a client, and writes surfaces and forces for a client.
//
// OpenIGTLink and 3D Slicer speak RAS and millimetres (RAS = (-x, -y, z) of
// LPS); bundles and scenes speak LPS and metres. The change of frame is a half turn about z, F = diag(-1, -1, 1): a point
// p becomes 1000 F p, a tool's turn R becomes F R F (the tool's own points are in LPS, as in the scene file), a force
// F f, and triangles keep their sense.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "programs/player/player.h"

namespace palpate {

struct ToolPose {
  SceneConfig::Vector position{};  // m, LPS
  Rotation turn = kNoTurn;
};

// One message of a client. The body of a type that is not used here is skipped without being stored.
struct IgtlRequest {
  enum class Kind { pose, get_surface, start_surface, stop_surface, skipped, refused };
  Kind kind = Kind::skipped;
  std::string type, device;
  ToolPose pose;         // of `pose`
  double interval = 0;   // s, of `start_surface`: the least between two; 0 where none was asked for
  std::string refusal;   // of `refused`: what was expected and found
  bool closing = false;  // the bytes that follow cannot be told apart any more: close the connection
};

// Turns a client's bytes, which come in any pieces, into messages. Safe on any bytes; stores at most kMostBody of them. Header versions 1 and 2 (protocol 3: extended header and metadata, which are passed over).
class IgtlStream {
 public:
  static constexpr std::size_t kMostBody = 65536;  // of the messages that are read

  // on_request is called for each message that is complete with these bytes. Returns false once the connection is to
  // be closed; later bytes are then ignored.
  template <typename OnRequest>
  bool take(std::span<const unsigned char> bytes, const OnRequest& on_request) {
    IgtlRequest request;
    while (!closed_ && next(bytes, &request)) {
      closed_ = request.closing;
      on_request(request);
      request = {};
    }
    return !closed_;
  }

 private:
  bool next(std::span<const unsigned char>& bytes, IgtlRequest* request);
  bool fill(std::span<const unsigned char>& bytes, std::size_t wanted);
  bool read_header(IgtlRequest* request);
  void read_body(IgtlRequest* request);

  std::vector<unsigned char> held_;  // header, then body
  std::uint64_t body_bytes_ = 0, to_skip_ = 0, crc_ = 0;
  std::string type_, device_;
  int version_ = 0;
  bool has_header_ = false, closed_ = false;
};

using IgtlBytes = std::vector<unsigned char>;

// POLYDATA: the deformed surface, RAS mm, with its displacement as a point vector. The triangles never change.
class SurfaceMessage {
 public:
  SurfaceMessage(std::string device, const std::int32_t* triangles, int triangle_count, int node_count);
  ~SurfaceMessage();
  // positions, displacements: [node_count][3] m, LPS.
  IgtlBytes pack(const float* positions, const float* displacements);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

// SENSOR: three numbers with the unit N, the force of the organ on the tool, in RAS. SENSOR is the type of the
// protocol for numbers with a unit. Slicer makes no node of it; it does of a STRING.
IgtlBytes force_message(const std::string& device, const double* force);

// STRING: the same force as "x y z N".
IgtlBytes force_text_message(const std::string& device, const double* force);

// RTS_POLYDATA: the answer to STT_ and STP_POLYDATA, one byte: 0, done.
IgtlBytes done_message(const std::string& device);

}  // namespace palpate
