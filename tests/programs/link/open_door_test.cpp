// palpate-igtl as a process. The clients are the classes of the OpenIGTLink library, and raw bytes.
#include <gmock/gmock.h>
#include <igtlClientSocket.h>
#include <igtlMessageHeader.h>
#include <igtlPolyDataMessage.h>
#include <igtlSensorMessage.h>
#include <igtlStringMessage.h>
#include <igtlTransformMessage.h>
#include <igtl_header.h>
#include <igtl_unit.h>
#include <igtl_util.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <random>

#include "programs/link/igtl_messages.h"
#include "tests/programs/link/linked_scene.h"
#include "tests/programs/link/process.h"

namespace palpate {
namespace {

using testing::HasSubstr;
using tests::Bytes;
using tests::Process;

const std::string kOneTool = "[[tool]]\nname = \"probe\"\npoints = [[0, 0, 0]]\npath = [[0, 41, 26, 44]]\n";
constexpr int kMostMessages = 5000;  // read before a test gives up

class Client {
 public:
  explicit Client(int port) : socket(igtl::ClientSocket::New()) {
    connected = socket->ConnectToServer("127.0.0.1", port) == 0;
    socket->SetTimeout(30000);
  }
  ~Client() { socket->CloseSocket(); }

  // A pose in RAS mm, turned about z.
  void move(const std::string& device, float x, float y, float z, float angle = 0) {
    igtl::Matrix4x4 matrix = {{std::cos(angle), -std::sin(angle), 0, x},
                              {std::sin(angle), std::cos(angle), 0, y},
                              {0, 0, 1, z},
                              {0, 0, 0, 1}};
    igtl::TransformMessage::Pointer message = igtl::TransformMessage::New();
    message->SetDeviceName(device.c_str());
    message->SetMatrix(matrix);
    message->Pack();
    socket->Send(message->GetPackPointer(), message->GetPackSize());
  }
  void send(const Bytes& bytes) { socket->Send(bytes.data(), static_cast<int>(bytes.size())); }
  void ask(const std::string& type, const Bytes& body = {});

  // Reads messages until one of that type comes. Returns its bytes with the header; none where the server closed the
  // connection.
  Bytes next_bytes(const std::string& type) {
    for (int n = 0; n < kMostMessages; ++n) {
      igtl::MessageHeader::Pointer header = igtl::MessageHeader::New();
      header->InitPack();
      if (socket->Receive(header->GetPackPointer(), IGTL_HEADER_SIZE) != IGTL_HEADER_SIZE) return {};
      const auto* from = static_cast<const unsigned char*>(header->GetPackPointer());
      Bytes bytes(from, from + IGTL_HEADER_SIZE);
      header->Unpack();
      const int body = header->GetBodySizeToRead();
      bytes.resize(IGTL_HEADER_SIZE + static_cast<std::size_t>(body));
      if (socket->Receive(bytes.data() + IGTL_HEADER_SIZE, body) != body) return {};
      if (header->GetDeviceType() == type) return bytes;
    }
    return {};
  }

  // The same, unpacked by the library's own class, which compares the checksum.
  template <class Message>
  typename Message::Pointer next(const std::string& type) {
    Bytes bytes = next_bytes(type);
    if (bytes.empty()) return nullptr;
    igtl::MessageHeader::Pointer header = igtl::MessageHeader::New();
    header->InitPack();
    std::copy_n(bytes.begin(), IGTL_HEADER_SIZE, static_cast<unsigned char*>(header->GetPackPointer()));
    header->Unpack();
    typename Message::Pointer message = Message::New();
    message->SetMessageHeader(header);
    message->AllocatePack();
    std::copy(bytes.begin() + IGTL_HEADER_SIZE, bytes.end(),
              static_cast<unsigned char*>(message->GetPackBodyPointer()));
    if (message->Unpack(1) & igtl::MessageHeader::UNPACK_BODY) return message;
    return nullptr;
  }

  igtl::ClientSocket::Pointer socket;
  bool connected = false;
};

Bytes message_bytes(const std::string& type, const std::string& device, const Bytes& body, int version = 1) {
  igtl_header header = {};
  header.version = static_cast<igtl_uint16>(version);
  std::copy_n(type.data(), std::min<std::size_t>(type.size(), 12), header.name);
  std::copy_n(device.data(), std::min<std::size_t>(device.size(), 20), header.device_name);
  header.body_size = body.size();
  Bytes copy = body;
  header.crc = crc64(copy.data(), copy.size(), 0);
  igtl_header_convert_byte_order(&header);
  Bytes bytes(IGTL_HEADER_SIZE + body.size());
  std::memcpy(bytes.data(), &header, IGTL_HEADER_SIZE);
  std::copy(body.begin(), body.end(), bytes.begin() + IGTL_HEADER_SIZE);
  return bytes;
}

void Client::ask(const std::string& type, const Bytes& body) {
  send(message_bytes(type, "organ", body));
}

Bytes pose_body(std::array<float, 12> numbers) {
  Bytes body;
  for (const float number : numbers)
    for (int i = 3; i >= 0; --i)
      body.push_back(static_cast<unsigned char>(std::bit_cast<std::uint32_t>(number) >> 8 * i));
  return body;
}
const std::array<float, 12> kAbove = {1, 0, 0, 0, 1, 0, 0, 0, 1, -41, -26, 44};

class OpenDoor : public tests::LinkedScene {
 protected:
  void start(const std::vector<std::string>& options = {}) {
    scene("scene", "", kOneTool);
    std::vector<std::string> words = {PALPATE_IGTL, (folder_ / "scene.toml").string(), "--listen", "0", "--seconds",
                                      "120"};
    words.insert(words.end(), options.begin(), options.end());
    server_ = std::make_unique<Process>(words, folder_ / "out", folder_ / "err");
    const std::string address = server_->address();
    port_ = std::stoi(address.substr(address.rfind(':') + 1));
  }
  // Waits for a line; false where it does not come.
  bool says(const std::string& part) {
    for (int tries = 0; tries < 3000; ++tries, ::usleep(10000))
      if (server_->errors().find(part) != std::string::npos) return true;
    return false;
  }
  void stop() {
    server_->stop();
    EXPECT_EQ(server_->wait(), 0) << server_->errors();
  }

  // The results of the C API for the same two poses, LPS.
  struct Expected {
    double force[3];
    std::vector<float> positions;
  };
  Expected expected(double depth) {
    Player player(scene("expected", "", kOneTool), bundle());
    tests::OwnContacts contacts(player);
    for (const double z : {0.044, depth})
      for (int step = 0; step < 50; ++step) {  // long enough for the force's slew
        player.place_tool(0, {0.041, 0.026, z});
        player.touch(1e-3, contacts.get(), contacts.bytes());
      }
    Expected out = {{}, tests::shape_of(player, contacts.get())};
    std::copy_n(palpate_contacts_tool(contacts.get(), 0)->force, 3, out.force);
    return out;
  }

  std::unique_ptr<Process> server_;
  int port_ = 0;
};

TEST_F(OpenDoor, TellsAClientTheForceAndTheSurfaceThatTheCApiGives) {
  start();
  Client client(port_);
  ASSERT_TRUE(client.connected);
  client.move("probe", -41, -26, 44);                                   // RAS mm, above the box
  ASSERT_TRUE(client.next<igtl::SensorMessage>("SENSOR").IsNotNull());  // the tool is there
  client.move("probe", -41, -26, 35);
  const Expected want = expected(0.035);
  ASSERT_GT(want.force[2], 0.01);
  igtl::SensorMessage::Pointer force;
  for (int n = 0; n < kMostMessages; ++n) {
    force = client.next<igtl::SensorMessage>("SENSOR");
    ASSERT_TRUE(force.IsNotNull());
    if (std::abs(force->GetValue(2) - want.force[2]) < 1e-9) break;
  }
  ASSERT_EQ(force->GetLength(), 3u);
  EXPECT_EQ(std::string(force->GetDeviceName()), "probe");
  EXPECT_NEAR(force->GetValue(0), -want.force[0], 1e-9);  // N: LPS -> RAS turns x and y about
  EXPECT_NEAR(force->GetValue(1), -want.force[1], 1e-9);
  EXPECT_NEAR(force->GetValue(2), want.force[2], 1e-9);
  igtl::Unit::Pointer unit = igtl::Unit::New(), newton = igtl::Unit::New();
  newton->Init();
  newton->Append(IGTL_UNIT_SI_DERIVED_NEWTON, 1);
  EXPECT_EQ(force->GetUnit(), newton->Pack());

  client.ask("GET_POLYDATA");
  igtl::PolyDataMessage::Pointer surface;
  float worst = 1;
  for (int n = 0; n < kMostMessages && worst > 1e-4f; ++n) {  // the surfaces streamed before may be older
    surface = client.next<igtl::PolyDataMessage>("POLYDATA");
    ASSERT_TRUE(surface.IsNotNull());
    ASSERT_EQ(surface->GetPoints()->GetNumberOfPoints(), static_cast<int>(want.positions.size() / 3));
    worst = 0;
    for (int i = 0; i < surface->GetPoints()->GetNumberOfPoints(); ++i) {
      float p[3];
      surface->GetPoints()->GetPoint(static_cast<unsigned>(i), p);
      const float* q = want.positions.data() + 3 * i;
      for (int d = 0; d < 3; ++d) worst = std::max(worst, std::abs(p[d] - (d < 2 ? -1000 : 1000) * q[d]));
    }
  }
  EXPECT_LE(worst, 1e-4f);  // mm: floats of 60 mm
  EXPECT_EQ(std::string(surface->GetDeviceName()), "organ");
  const Player player(scene("rest", "", kOneTool), bundle());
  EXPECT_EQ(static_cast<int>(surface->GetPolygons()->GetNumberOfCells()),
            palpate_bundle_describe(player.bundle()).triangle_count);
  igtlUint32 corners[3];
  surface->GetPolygons()->GetCell(0, corners);
  EXPECT_EQ(static_cast<std::int32_t>(corners[1]), palpate_bundle_triangles(player.bundle())[1]);
  ASSERT_EQ(surface->GetNumberOfAttributes(), 1);
  EXPECT_EQ(std::string(surface->GetAttribute(0)->GetName()), "displacement");

  igtl::StringMessage::Pointer text = client.next<igtl::StringMessage>("STRING");
  ASSERT_TRUE(text.IsNotNull());
  EXPECT_THAT(text->GetString(), HasSubstr(" N"));
  stop();
}

TEST_F(OpenDoor, SendsTheSurfaceOnRequestAloneWhereTold) {
  start({"--on-request"});
  Client client(port_);
  client.move("probe", -41, -26, 44);
  for (int n = 0; n < 20; ++n) ASSERT_TRUE(client.next<igtl::SensorMessage>("SENSOR").IsNotNull());
  client.ask("STT_POLYDATA", {0, 0, 0, 0, 0x10, 0, 0, 0});  // a sixteenth of a second between two
  const Bytes answer = client.next_bytes("RTS_POLYDATA");
  ASSERT_EQ(answer.size(), IGTL_HEADER_SIZE + 1u);
  EXPECT_EQ(answer.back(), 0);  // done
  for (int n = 0; n < 3; ++n) ASSERT_TRUE(client.next<igtl::PolyDataMessage>("POLYDATA").IsNotNull());
  client.ask("STP_POLYDATA");
  EXPECT_FALSE(client.next_bytes("RTS_POLYDATA").empty());
  client.ask("GET_POLYDATA");
  EXPECT_TRUE(client.next<igtl::PolyDataMessage>("POLYDATA").IsNotNull());
  stop();
}

TEST_F(OpenDoor, ServesSeveralClientsAndThoseThatComeBack) {
  start();
  Client watcher(port_);
  for (int round = 0; round < 3; ++round) {
    Client mover(port_);
    mover.move("probe", -41, -26, 44);
    EXPECT_TRUE(mover.next<igtl::SensorMessage>("SENSOR").IsNotNull()) << round;
    EXPECT_TRUE(watcher.next<igtl::SensorMessage>("SENSOR").IsNotNull()) << round;
  }
  EXPECT_TRUE(watcher.next<igtl::PolyDataMessage>("POLYDATA").IsNotNull());
  EXPECT_TRUE(says("gone"));
  stop();
}

TEST_F(OpenDoor, OutlivesWhateverClientsSendAndSaysWhatWasWrong) {
  start();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  auto with = [](int at, float value) {
    auto numbers = kAbove;
    numbers[static_cast<std::size_t>(at)] = value;
    return pose_body(numbers);
  };
  {
    Client client(port_);
    client.send(message_bytes("TRANSFORM", "probe", with(9, nan)));
    client.send(message_bytes("TRANSFORM", "probe", with(0, 2)));   // scales
    client.send(message_bytes("TRANSFORM", "probe", with(8, -1)));  // mirrors
    client.send(message_bytes("TRANSFORM", "probe", Bytes(47)));
    client.send(message_bytes("TRANSFORM", "stranger", pose_body(kAbove)));
    client.send(message_bytes("IMAGE", "camera", Bytes(5000)));
    Bytes damaged = message_bytes("TRANSFORM", "probe", pose_body(kAbove));
    damaged.back() ^= 1;
    client.send(damaged);
    client.send(message_bytes("TRANSFORM", "probe", pose_body(kAbove)));  // and it still listens
    EXPECT_TRUE(client.next<igtl::SensorMessage>("SENSOR").IsNotNull());
  }
  for (const std::string said : {"expected finite numbers", "scales or shears", "found a mirror", "expected 48 bytes",
                                 "no tool of that name", "\"IMAGE\" are passed over", "checksum does not fit"})
    EXPECT_TRUE(says(said)) << said << "\n" << server_->errors();
  {
    Client client(port_);
    client.send(message_bytes("TRANSFORM", "probe", pose_body(kAbove), 3));
    EXPECT_TRUE(says("found version 3"));
  }
  {
    Client client(port_);
    Bytes large = message_bytes("TRANSFORM", "probe", {});
    large[42] = 0x7f;  // 2^63 bytes and more will follow
    client.send(large);
    EXPECT_TRUE(says("TRANSFORM of at most"));
  }
  const Bytes whole = message_bytes("TRANSFORM", "probe", pose_body(kAbove));
  std::mt19937 random(3);
  for (std::size_t count = 0; count < whole.size(); count += 7) {
    Client cut(port_), garbage(port_);
    cut.send(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(count)));
    Bytes noise(1 + random() % 400);
    for (auto& byte : noise) byte = static_cast<unsigned char>(random());
    garbage.send(noise);
  }
  Client client(port_);
  client.move("probe", -41, -26, 44);
  EXPECT_TRUE(client.next<igtl::SensorMessage>("SENSOR").IsNotNull());
  stop();
}

TEST_F(OpenDoor, RefusesBadUsageInOneSentence) {
  scene("scene", "", kOneTool);
  scene("long", "", "[[tool]]\nname = \"a name that is far too long\"\npoints = [[0, 0, 0]]\npath = [[0, 0, 0, 0]]\n");
  const auto refused = [&](const std::string& file, const std::vector<std::string>& options, const std::string& part) {
    std::vector<std::string> words = {PALPATE_IGTL, (folder_ / file).string()};
    words.insert(words.end(), options.begin(), options.end());
    Process process(words, folder_ / "out", folder_ / "err");
    EXPECT_EQ(process.wait(), 2);
    EXPECT_THAT(process.errors(), HasSubstr(part));
  };
  refused("long.toml", {}, "1 to 20 characters");
  refused("scene.toml", {"--listen", "here"}, "--listen: expected PORT");
  refused("scene.toml", {"--device", ""}, "--device");
  refused("absent.toml", {}, "absent.toml");
}

// ---- the stream of one client, in this process ----

std::vector<IgtlRequest> requests_of(const Bytes& bytes, std::size_t piece) {
  IgtlStream stream;
  std::vector<IgtlRequest> out;
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    const std::size_t count = std::min(piece, bytes.size() - at);
    const std::unique_ptr<unsigned char[]> copy(new unsigned char[count]);  // a sanitizer sees one byte too far
    std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), count, copy.get());
    if (!stream.take({copy.get(), count}, [&](const IgtlRequest& request) { out.push_back(request); })) break;
  }
  return out;
}

TEST(IgtlStream, ReadsMessagesInPiecesOfAnySize) {
  Bytes bytes = message_bytes("TRANSFORM", "probe", pose_body(kAbove));
  const Bytes others = message_bytes("IMAGE", "camera", Bytes(300)), ask = message_bytes("GET_POLYDATA", "", {});
  bytes.insert(bytes.end(), others.begin(), others.end());
  bytes.insert(bytes.end(), ask.begin(), ask.end());
  for (std::size_t piece = 1; piece <= bytes.size(); ++piece) {
    const auto requests = requests_of(bytes, piece);
    ASSERT_EQ(requests.size(), 3u) << piece;
    EXPECT_EQ(requests[0].kind, IgtlRequest::Kind::pose);
    EXPECT_EQ(requests[1].kind, IgtlRequest::Kind::skipped);
    EXPECT_EQ(requests[2].kind, IgtlRequest::Kind::get_surface);
  }
}

// From RAS to LPS is a half turn about z: a quarter turn about x becomes the opposite one, one about z stays.
TEST(IgtlStream, TurnsRasMillimetresIntoLpsMetres) {
  const auto pose = requests_of(message_bytes("TRANSFORM", "probe", pose_body(kAbove)), 1000)[0].pose;
  EXPECT_EQ(pose.position, (SceneConfig::Vector{0.041, 0.026, 0.044}));
  EXPECT_EQ(pose.turn, kNoTurn);
  const auto turned = [](std::array<float, 12> columns) {
    return requests_of(message_bytes("TRANSFORM", "probe", pose_body(columns)), 1000)[0].pose.turn;
  };
  EXPECT_EQ(turned({0, 1, 0, -1, 0, 0, 0, 0, 1, 0, 0, 0}), (Rotation{{{0, -1, 0}, {1, 0, 0}, {0, 0, 1}}}));
  EXPECT_EQ(turned({1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 0, 0}), (Rotation{{{1, 0, 0}, {0, 0, 1}, {0, -1, 0}}}));
}

TEST(IgtlStream, ReadsHeadersOfVersion2WithTheirMetadata) {
  Bytes body = {0, 12, 0, 4, 0, 0, 0, 3, 0, 0, 0, 9};  // extended header, metadata's header of 4 and 3 bytes of it
  const Bytes content = pose_body(kAbove);
  body.insert(body.end(), content.begin(), content.end());
  body.insert(body.end(), 7, 0);
  const auto requests = requests_of(message_bytes("TRANSFORM", "probe", body, 2), 1000);
  ASSERT_EQ(requests.size(), 1u);
  EXPECT_EQ(requests[0].kind, IgtlRequest::Kind::pose);
  EXPECT_EQ(requests[0].pose.position[2], 0.044);
  for (const std::size_t at : {0u, 2u, 4u}) {  // lengths beyond the body
    Bytes wrong = body;
    wrong[at] = 0xff;
    EXPECT_EQ(requests_of(message_bytes("TRANSFORM", "probe", wrong, 2), 1000)[0].kind, IgtlRequest::Kind::refused);
  }
}

// The header has no checksum of its own: a message with a changed name may be accepted, but never as a pose of the probe.
TEST(IgtlStream, TakesNoPoseOfAMessageWithAnyByteChanged) {
  const Bytes whole = message_bytes("TRANSFORM", "probe", pose_body(kAbove));
  for (std::size_t at = 0; at < whole.size(); ++at)
    for (const unsigned char change : {0x01, 0x80, 0xff}) {
      const bool time_stamp = at >= 34 && at < 42, after_a_name = (at > 2 + 9 && at < 14) || (at > 14 + 5 && at < 34);
      if (time_stamp || after_a_name) continue;  // nothing is read there
      Bytes bytes = whole;
      bytes[at] ^= change;
      for (const IgtlRequest& request : requests_of(bytes, 1000))
        EXPECT_FALSE(request.kind == IgtlRequest::Kind::pose && request.device == "probe") << at;
    }
}

}  // namespace
}  // namespace palpate
