// Sockets of the system, owned; addresses as people write them.
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
// Errors: InputError, which names the option, for a text that is none of them, a port beyond 65535, a host unknown.
SocketAddress resolve(const std::string& option, const std::string& text, int type);
std::string text_of(const SocketAddress& address);
SocketAddress address_of(int descriptor);  // its own: the port that was chosen for port 0

// A socket bound to an address (port 0: one that is free); a stream socket listens. Errors: InputError where the
// address cannot be used, which names the option.
Descriptor open_bound(const std::string& option, const SocketAddress& address, int type);

// A datagram socket that sends to one address and never waits.
class DatagramSender {
 public:
  explicit DatagramSender(const SocketAddress& to);
  // False where the system did not take it: its buffer is full, or nobody listened to the one before.
  bool send(std::span<const unsigned char> bytes);

 private:
  Descriptor socket_;
};

// Waits up to that long for one datagram. Returns its length, at most room.size(); nothing where none came in time.
// A datagram longer than the room is cut, and its length is then room.size().
std::optional<std::size_t> receive(int descriptor, int milliseconds, std::span<unsigned char> room);

}  // namespace palpate
