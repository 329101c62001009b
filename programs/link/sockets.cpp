#include "programs/link/sockets.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <utility>

#include "formats/errors.h"

namespace palpate {

Descriptor::Descriptor(Descriptor&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  return *this;
}
Descriptor::~Descriptor() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

SocketAddress resolve(const std::string& option, const std::string& text, int type) {
  const std::size_t colon = text.rfind(':');
  std::string host = colon == std::string::npos ? "127.0.0.1" : text.substr(0, colon);
  const std::string port = colon == std::string::npos ? text : text.substr(colon + 1);
  if (host.size() > 1 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  const bool digits = !port.empty() && port.size() <= 5 &&
                      std::all_of(port.begin(), port.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (!digits || std::stoi(port) > 65535 || host.empty())
    throw InputError(
        fmt::format("{}: expected PORT (0 to 65535), HOST:PORT or [IPv6]:PORT, found \"{}\"", option, text));
  addrinfo wanted = {};
  wanted.ai_socktype = type;
  wanted.ai_flags = AI_NUMERICSERV;
  addrinfo* found = nullptr;
  if (const int error = ::getaddrinfo(host.c_str(), port.c_str(), &wanted, &found); error != 0)
    throw InputError(
        fmt::format("{}: expected a host that is known here, found \"{}\": {}", option, host, ::gai_strerror(error)));
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> owner(found, &::freeaddrinfo);
  SocketAddress address;
  address.bytes = found->ai_addrlen;
  std::memcpy(&address.storage, found->ai_addr, found->ai_addrlen);
  return address;
}

std::string text_of(const SocketAddress& address) {
  char host[NI_MAXHOST] = "?", port[NI_MAXSERV] = "?";
  ::getnameinfo(reinterpret_cast<const sockaddr*>(&address.storage), address.bytes, host, sizeof host, port,
                sizeof port, NI_NUMERICHOST | NI_NUMERICSERV);
  return address.storage.ss_family == AF_INET6 ? fmt::format("[{}]:{}", host, port) : fmt::format("{}:{}", host, port);
}

SocketAddress address_of(int descriptor) {
  SocketAddress address;
  address.bytes = sizeof address.storage;
  ::getsockname(descriptor, reinterpret_cast<sockaddr*>(&address.storage), &address.bytes);
  return address;
}

Descriptor open_bound(const std::string& option, const SocketAddress& address, int type) {
  Descriptor opened(::socket(address.storage.ss_family, type | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const int yes = 1;
  const int room =
      4 << 20;  // bytes asked for, so that a reader that is held up loses less; the system gives what it will
  if (type == SOCK_STREAM) ::setsockopt(opened.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (type == SOCK_DGRAM) ::setsockopt(opened.get(), SOL_SOCKET, SO_RCVBUF, &room, sizeof room);
  if (opened.get() < 0 ||
      ::bind(opened.get(), reinterpret_cast<const sockaddr*>(&address.storage), address.bytes) != 0 ||
      (type == SOCK_STREAM && ::listen(opened.get(), 16) != 0))
    throw InputError(fmt::format("{}: {} cannot be listened to: {}; choose another port or address", option,
                                 text_of(address), std::strerror(errno)));
  return opened;
}

DatagramSender::DatagramSender(const SocketAddress& to)
    : socket_(::socket(to.storage.ss_family, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
  if (socket_.get() < 0 || ::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&to.storage), to.bytes) != 0)
    throw OperationError(fmt::format("{}: cannot be sent to: {}", text_of(to), std::strerror(errno)));
}

bool DatagramSender::send(std::span<const unsigned char> bytes) {
  return ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
}

std::optional<std::size_t> receive(int descriptor, int milliseconds, std::span<unsigned char> room) {
  pollfd waited = {descriptor, POLLIN, 0};
  if (::poll(&waited, 1, milliseconds) <= 0) return std::nullopt;
  const ssize_t count = ::recv(descriptor, room.data(), room.size(), MSG_DONTWAIT);
  if (count < 0) return std::nullopt;
  return static_cast<std::size_t>(count);
}

}  // namespace palpate
