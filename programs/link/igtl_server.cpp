#include "programs/link/igtl_server.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <list>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include "programs/link/igtl_messages.h"
#include "programs/link/sockets.h"
#include "programs/player/contacts_mailbox.h"
#include "programs/player/deform_thread.h"
#include "programs/player/touch_loop.h"

namespace palpate {
namespace {

constexpr std::size_t kMostClients = 16;
constexpr std::size_t kMostQueued = 64 << 20;  // bytes, of one client that asks and does not read

using Say = std::function<void(const std::string&)>;

// The tools' positions, from the thread that receives them to the thread that touches, which never waits.
class ToolTable {
 public:
  explicit ToolTable(std::size_t tools) : poses_(tools) {}

  void set(std::size_t tool, const ToolPose& pose) {
    const std::lock_guard lock(mutex_);
    poses_[tool] = pose;
  }
  void clear(std::size_t tool) {
    const std::lock_guard lock(mutex_);
    poses_[tool].reset();
  }

  // Moves the player's tools. Returns a bit for each tool that exists. While the other thread writes, the tools keep their
  // positions for this step.
  std::uint32_t move(Player& player) {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock) return present_;
    present_ = 0;
    for (std::size_t t = 0; t < poses_.size(); ++t)
      if (poses_[t]) {
        player.place_tool(t, poses_[t]->position, poses_[t]->turn);
        present_ |= 1u << t;
      } else {
        player.withdraw_tool(t);
      }
    return present_;
  }

 private:
  std::mutex mutex_;
  std::vector<std::optional<ToolPose>> poses_;
  std::uint32_t present_ = 0;  // the mover's own
};

struct Client {
  Descriptor socket;
  std::string name;
  IgtlStream stream;
  IgtlBytes queued;  // and not yet taken by the system
  std::set<std::string> said;
  bool streams = true, open = true;
  double interval = 0, surface_at = 0;  // s
};

class Server {
 public:
  Server(Player& player, int listening, const IgtlServerOptions& options, const Say& say)
      : player_(player),
        listening_(listening),
        options_(options),
        say_(say),
        tools_(player.scene().tools.size()),
        owner_(player.scene().tools.size(), nullptr),
        mailbox_(palpate_contacts_bytes(player.runtime_scene())),
        nodes_(palpate_bundle_describe(player.bundle()).surface_node_count),
        displacements_(3 * static_cast<std::size_t>(player.shape_node_count())),
        positions_(displacements_.size()),
        surface_(options.device, palpate_bundle_triangles(player.bundle()),
                 palpate_bundle_describe(player.bundle()).triangle_count, nodes_) {}

  IgtlServerRun run(const std::atomic<bool>* stop) {
    std::atomic<bool> stop_touching{false};
    DeformThread deforming(player_.runtime_scene());
    std::thread touching([&] { touch(stop_touching); });
    const double start = seconds();
    while (!(stop && stop->load()) && (options_.seconds == 0 || seconds() - start < options_.seconds)) {
      wait();
      send_what_is_due();
      clients_.remove_if([&](Client& client) {
        if (client.open) return false;
        leave(client);
        return true;
      });
    }
    stop_touching.store(true);
    touching.join();
    return run_;
  }

 private:
  static double seconds() { return static_cast<double>(now()) * 1e-9; }

  void touch(const std::atomic<bool>& stop) {
    std::uint32_t present = 0;
    run_touch_loop(
        {player_, run_.touch, run_.touch_flags, player_.scene().touch_hz, ~std::uint64_t{0} >> 8, LateSteps::left_out,
         &stop},
        now(), mailbox_.contacts_bytes(), [&](std::uint64_t, std::uint64_t) { present = tools_.move(player_); },
        [&] { return mailbox_.slot(); },
        [&](std::uint64_t, Nanoseconds) {
          mailbox_.publish(present);
          keep_bounded(run_.touch);
        });
  }

  // A server may run for days, so the report covers the last steps only.
  static void keep_bounded(LoopTiming& timing) {
    constexpr std::size_t kMost = 1 << 20;
    for (auto* numbers : {&timing.work, &timing.wake_up})
      if (numbers->size() >= kMost) numbers->clear();
  }

  // Waits until a client sends something, or the next message is due.
  void wait() {
    std::vector<pollfd> watched = {{listening_, POLLIN, 0}};
    for (const Client& client : clients_)
      watched.push_back(
          {client.socket.get(), static_cast<short>(client.queued.empty() ? POLLIN : POLLIN | POLLOUT), 0});
    const double due = std::min(force_at_, surface_at_) - seconds();
    ::poll(watched.data(), watched.size(), std::clamp(static_cast<int>(due * 1000) + 1, 0, 100));
    std::size_t at = 1;
    for (Client& client : clients_) {
      const short events = watched[at++].revents;
      if (events & POLLOUT) flush(client);
      if (events & ~POLLOUT) hear(client);
    }
    if (watched[0].revents) welcome();
  }

  void welcome() {
    SocketAddress from;
    from.bytes = sizeof from.storage;
    Descriptor accepted(
        ::accept4(listening_, reinterpret_cast<sockaddr*>(&from.storage), &from.bytes, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (accepted.get() < 0) return;
    if (clients_.size() == kMostClients)
      return say_(fmt::format("{}: sent away, {} clients are here already", text_of(from), kMostClients));
    ++run_.clients;
    Client& client = clients_.emplace_back();
    client.socket = std::move(accepted);
    client.name = text_of(from);
    client.streams = !options_.on_request;
    say_(fmt::format("{}: connected", client.name));
  }

  void leave(Client& client) {
    for (std::size_t t = 0; t < owner_.size(); ++t)
      if (owner_[t] == &client) tools_.clear(t), owner_[t] = nullptr;
    say_(fmt::format("{}: gone", client.name));
  }

  void say_once(Client& client, const std::string& kind, const std::string& text) {
    if (client.said.size() < 32 && client.said.insert(kind).second) say_(fmt::format("{}: {}", client.name, text));
  }

  void hear(Client& client) {
    unsigned char room[65536];
    const ssize_t count = ::recv(client.socket.get(), room, sizeof room, 0);
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (count <= 0) {
      client.open = false;
      return;
    }
    if (!client.stream.take({room, static_cast<std::size_t>(count)},
                            [&](const IgtlRequest& request) { answer(client, request); }))
      client.open = false;
  }

  void answer(Client& client, const IgtlRequest& request) {
    switch (request.kind) {
      case IgtlRequest::Kind::pose:
        return move_tool(client, request);
      case IgtlRequest::Kind::get_surface:
        return queue(client, make_surface());
      case IgtlRequest::Kind::start_surface:
        client.streams = true, client.interval = request.interval, client.surface_at = 0;
        return queue(client, done_message(options_.device));
      case IgtlRequest::Kind::stop_surface:
        client.streams = false;
        return queue(client, done_message(options_.device));
      case IgtlRequest::Kind::skipped:
        return say_once(client, "type " + request.type,
                        fmt::format("messages of type \"{}\" are passed over", request.type));
      case IgtlRequest::Kind::refused:
        ++run_.refused;
        return say_once(client, request.refusal, request.refusal + (request.closing ? "; closed" : ""));
    }
  }

  void move_tool(Client& client, const IgtlRequest& request) {
    const auto& tools = player_.scene().tools;
    const auto tool = std::find_if(tools.begin(), tools.end(), [&](const auto& t) { return t.name == request.device; });
    if (tool == tools.end())
      return say_once(
          client, "tool " + request.device,
          fmt::format("a TRANSFORM of \"{}\" is passed over: the scene has no tool of that name", request.device));
    const auto index = static_cast<std::size_t>(tool - tools.begin());
    tools_.set(index, request.pose);
    owner_[index] = &client;
    ++run_.poses;
  }

  // The surface under the newest contacts.
  IgtlBytes make_surface() {
    std::uint32_t present = 0;
    if (const palpate_contacts* contacts = mailbox_.newest(&present)) {
      palpate_shape_out out = palpate_default_shape_out();
      out.displacements = displacements_.data(), out.positions = positions_.data(),
      out.node_capacity = player_.shape_node_count();
      run_.shape_flags.add(palpate_scene_shape(player_.runtime_scene(), contacts, &out));
    }
    return surface_.pack(positions_.data(), displacements_.data());
  }

  void send_what_is_due() {
    const double time = seconds();
    std::uint32_t present = 0;
    const palpate_contacts* contacts = mailbox_.newest(&present);
    if (!contacts) return;  // no step has been made yet
    if (time >= force_at_) {
      force_at_ = time + 1 / options_.force_rate;
      send_forces(*contacts, present, force_message);
    }
    if (time < surface_at_) return;
    surface_at_ = time + 1 / options_.surface_rate;
    send_forces(*contacts, present, force_text_message);
    IgtlBytes surface;
    for (Client& client : clients_) {
      if (!client.streams || time < client.surface_at) continue;
      if (surface.empty()) surface = make_surface();
      client.surface_at = time + client.interval;
      ++run_.surfaces;
      send(client, surface);
    }
  }

  template <typename Message>
  void send_forces(const palpate_contacts& contacts, std::uint32_t present, const Message& message) {
    for (std::int32_t t = 0; t < contacts.tool_count; ++t)
      if (present >> t & 1) {
        const IgtlBytes bytes = message(player_.scene().tools[static_cast<std::size_t>(t)].name,
                                        palpate_contacts_tool(&contacts, t)->force);
        for (Client& client : clients_) send(client, bytes), ++run_.forces;
      }
  }

  // A client that has not read the message before gets no periodic message.
  void send(Client& client, const IgtlBytes& bytes) {
    if (client.queued.empty())
      queue(client, bytes);
    else
      ++run_.left_out;
  }

  void queue(Client& client, const IgtlBytes& bytes) {
    if (client.queued.size() + bytes.size() > kMostQueued) {
      say_once(client, "queue", "asks and does not read; closed");
      client.open = false;
      return;
    }
    client.queued.insert(client.queued.end(), bytes.begin(), bytes.end());
    flush(client);
  }

  static void flush(Client& client) {
    const ssize_t count = ::send(client.socket.get(), client.queued.data(), client.queued.size(), MSG_NOSIGNAL);
    if (count > 0) client.queued.erase(client.queued.begin(), client.queued.begin() + count);
    if (count < 0 && errno != EAGAIN && errno != EINTR) client.open = false;
  }

  Player& player_;
  int listening_;
  const IgtlServerOptions& options_;
  const Say& say_;
  IgtlServerRun run_;
  std::list<Client> clients_;
  ToolTable tools_;
  std::vector<const Client*> owner_;  // [tool] who moved it last
  ContactsMailbox<std::uint32_t> mailbox_;
  int nodes_;
  std::vector<float> displacements_, positions_;
  SurfaceMessage surface_;
  double force_at_ = 0, surface_at_ = 0;  // s, when the next are due
};

}  // namespace

IgtlServerRun serve_igtl(Player& player, int listening, const IgtlServerOptions& options, const std::atomic<bool>* stop,
                         const std::function<void(const std::string&)>& say) {
  return Server(player, listening, options, say).run(stop);
}

std::string igtl_table(const IgtlServerRun& run) {
  return fmt::format(
             "{} clients, {} transforms taken, {} messages refused; {} surfaces and {} forces sent, {} left out\n"
             "touch: {} missed deadlines, preempted {} times; {}\n",
             run.clients, run.poses, run.refused, run.surfaces, run.forces, run.left_out, run.touch.missed,
             run.touch.preempted, run.touch.scheduling) +
         percentile_head("us") + percentile_row("touch", run.touch.work) +
         percentile_row("touch woken late", run.touch.wake_up) + "\n";
}

}  // namespace palpate
