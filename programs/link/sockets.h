// Sockets that close themselves, and addresses as users write them.
#pragma once

#include <sys/socket.h>

#include <cstddef>
#include <optional>
#include <span>
#include <string>

namespace palpate {

// A file descriptor that is closed with its owner.
class Descriptor {
 public:
  explicit Descriptor(int descriptor = -1) : descriptor_(descriptor) {}
  Descriptor(Descriptor&& other) noexcept;
  Descriptor& operator=(Descriptor&& other) noexcept;
  ~Descriptor();
  int get() const { return descriptor_; }

 private:
  int descriptor_;
};

struct SocketAddress {
  sockaddr_storage storage = {};
  socklen_t bytes = 0;
};

// "PORT" (on the loopback address 127.0.0.1), "HOST:PORT" or "[IPv6]:PORT". type: SOCK_DGRAM or SOCK_STREAM.
// Errors: InputError that names the option: another text, a port above 65535, an unknown host.
SocketAddress resolve(const std::string& option, const std::string& text, int type);
std::string text_of(const SocketAddress& address);
SocketAddress address_of(int descriptor);  // its own: the port that was chosen for port 0

// A socket bound to an address (port 0: the system chooses a free one); a stream socket listens. Errors: InputError where the
// address cannot be used, which names the option.
Descriptor open_bound(const std::string& option, const SocketAddress& address, int type);

// A datagram socket that sends to one address and does not wait.
class DatagramSender {
 public:
  explicit DatagramSender(const SocketAddress& to);
  // False where the system refuses the datagram: its buffer is full, or nobody received the one before.
  bool send(std::span<const unsigned char> bytes);

 private:
  Descriptor socket_;
};

// Waits up to that long for one datagram. Returns its length, or nothing where none came in time. A datagram longer than
// the room is cut to room.size().
std::optional<std::size_t> receive(int descriptor, int milliseconds, std::span<unsigned char> room);

}  // namespace palpate
