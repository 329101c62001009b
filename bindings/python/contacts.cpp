// palpate.Contacts, the result of touch and input of shape, and palpate.Mailbox, which hands them to another thread.
#include <algorithm>
#include <cstring>

#include "bindings/python/bindings.h"

namespace palpate::python {

bool HeldContacts::assign(const void* data, std::size_t size) {
  palpate_contacts head;
  if (size < sizeof head || size > bytes) return false;
  std::memcpy(&head, data, sizeof head);
  if (head.struct_bytes != sizeof head || head.tool_state_bytes != sizeof(palpate_tool_state) ||
      head.node_bytes != sizeof(palpate_contact_node) || head.tool_count < 0 || head.tool_count > PALPATE_MAX_TOOLS ||
      head.node_count < 0 || head.field_nodes < 0 || head.amount_count < 0)
    return false;
  // The parts one behind the other; a displacement field and amounts of motions where the scene has them.
  const auto bytes_of = [](std::int32_t count, std::size_t each) { return static_cast<std::size_t>(count) * each; };
  const std::size_t nodes_at = sizeof head + bytes_of(head.tool_count, sizeof(palpate_tool_state)),
                    field_at = nodes_at + bytes_of(head.node_count, sizeof(palpate_contact_node)),
                    amounts_at = field_at + (bytes_of(head.field_nodes, 3 * sizeof(float)) + 7) / 8 * 8;
  if (head.nodes_offset != nodes_at || head.field_offset != (head.field_nodes > 0 ? field_at : 0) ||
      head.amounts_offset != (head.amount_count > 0 ? amounts_at : 0) || head.used_bytes != size ||
      size != amounts_at + bytes_of(head.amount_count, sizeof(double)))
    return false;
  std::memcpy(contacts.get(), data, size);
  return true;
}

namespace {

void assign_bytes(HeldContacts& self, const py::buffer& data) {
  const HeldBuffer bytes(data);
  const InUse use(self.in_use, kContactsInUse);
  if (!self.assign(bytes.data(), bytes.size()))
    throw py::value_error("expected the data of contacts, at most " + std::to_string(self.bytes) + " bytes; found " +
                          std::to_string(bytes.size()) + " bytes that are none or do not fit");
}

// Hands the newest contacts from one thread to another. Publishing and fetching copy, with the interpreter's lock held.
class HeldMailbox {
 public:
  explicit HeldMailbox(const HeldContacts& like)
      : bytes_(like.bytes),
        memory_(aligned_memory(palpate_mailbox_bytes(like.bytes))),
        mailbox_(palpate_mailbox_create(memory_.get(), like.bytes)) {}

  void publish(HeldContacts& from) {
    const InUse use(from.in_use, kContactsInUse);
    const std::size_t used = from.contacts->used_bytes;
    if (used == 0 || used > bytes_)
      throw py::value_error("expected contacts that touch has filled, of the size that this mailbox was made for");
    std::memcpy(palpate_mailbox_slot(mailbox_), from.contacts.get(), used);
    palpate_mailbox_publish(mailbox_);
  }

  // True where *to is newer than at the last call.
  bool newest(HeldContacts& to) {
    const InUse use(to.in_use, kContactsInUse);
    std::int32_t fresh = 0;
    const palpate_contacts* contacts = palpate_mailbox_newest(mailbox_, &fresh);
    if (contacts && !to.assign(contacts, contacts->used_bytes))
      throw py::value_error("the newest contacts do not fit into these; make them with the scene that touches");
    return fresh != 0;
  }

 private:
  std::size_t bytes_;
  AlignedMemory memory_;
  palpate_mailbox* mailbox_;
};

py::array tool_states(const py::object& self) {
  const palpate_contacts& contacts = *self.cast<HeldContacts&>().contacts.get();
  return view_of(self, palpate_contacts_tool(&contacts, 0), {contacts.tool_count}, {sizeof(palpate_tool_state)});
}
py::array contact_nodes(const py::object& self) {
  const Contacts& contacts = self.cast<HeldContacts&>().contacts;
  return view_of(self, &contacts.node(0), {contacts->node_count}, {sizeof(palpate_contact_node)});
}
py::array tool_forces(const py::object& self) {
  const palpate_contacts& contacts = *self.cast<HeldContacts&>().contacts.get();
  return view_of(self, palpate_contacts_tool(&contacts, 0)->force, {contacts.tool_count, 3},
                 {sizeof(palpate_tool_state), sizeof(double)});
}
py::array used_bytes(const py::object& self) {
  const Contacts& contacts = self.cast<HeldContacts&>().contacts;
  return view_of(self, reinterpret_cast<const std::uint8_t*>(contacts.get()), {contacts->used_bytes});
}

void add_mailbox(py::module_& module) {
  py::class_<HeldMailbox>(
      module, "Mailbox",
      "Hands the newest contacts from a touching thread to a drawing thread; neither waits for the\n"
      "other. Contacts that were not fetched before the next ones are published are dropped.")
      .def(py::init<const HeldContacts&>(), py::arg("like"), "A mailbox for contacts of the size of `like`.")
      .def("publish", &HeldMailbox::publish, py::arg("contacts"), "Copies contacts that touch has filled.")
      .def(
          "newest", &HeldMailbox::newest, py::arg("contacts"),
          "Copies the newest into `contacts`, which stay as they are before the first. True where they were published\n"
          "since the last call.");
}

}  // namespace

void add_contacts(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(palpate_tool_state, force, force_raw, direction, contact_count, slip_count, release_count, flags,
                       id, torque, torque_raw);
  PYBIND11_NUMPY_DTYPE(palpate_contact, tool_id, tool, point, triangle, node, state, begun, barycentric, place, normal,
                       depth, gap, force, velocity, tool_point, disc_radius, disc_normal, indentation);
  PYBIND11_NUMPY_DTYPE(palpate_contact_event, kind, tool_id, point, contact, triangle, node, barycentric, place);
  PYBIND11_NUMPY_DTYPE(palpate_contact_node, node, column, source, index, point, modified_displacement, force);
  py::class_<HeldContacts, std::shared_ptr<HeldContacts>> type(
      module, "Contacts",
      "The result of touch and the input of shape. Scene.make_contacts makes it; arrays are read-only views of the\n"
      "last step, whose lengths are those at the time they were asked for.");
  type.def_property_readonly("force", &tool_forces,
                             "float64 [tools, 3], N, on each tool, within the scene's limits: send it to a device");
  type.def_property_readonly("tools", &tool_states,
                             "structured [tools]: force, force_raw, direction ([3] each), contact_count, slip_count,\n"
                             "release_count, flags, id");
  type.def_property_readonly("nodes", &contact_nodes,
                             "structured [nodes under contact]: node, column, source (0 a tool, 1 a needle, 2 a link, "
                             "3 an obstacle, 4 a blade, 5 a lip of a cut, 6 another organ, "
                             "7 a link of the world), index, point, modified_displacement ([3], "
                             "m), force ([3], N, on the organ)");
  const auto numbers = [&type](const char* name, auto member, std::size_t count, const char* doc) {
    type.def_property_readonly(
        name,
        [=](const py::object& self) {
          return view_of(self, self.cast<HeldContacts&>().contacts.get()->*member, {static_cast<py::ssize_t>(count)});
        },
        doc);
  };
  numbers("organ_position", &palpate_contacts::organ_position, 3,
          "float64 [3], m: where the organ's frame was in the world");
  numbers("organ_orientation", &palpate_contacts::organ_orientation, 4, "float64 [4]: its quaternion w, x, y, z");
  type.def_property_readonly("data", &used_bytes,
                             "uint8 [used]: the contacts as bytes, for a file, a socket or assign of other contacts");
  type.def("assign", &assign_bytes, py::arg("data"),
           "Copies the data of other contacts. Raises ValueError where data is not that of contacts.");
  type.def_property_readonly(
      "flags", [](const HeldContacts& self) { return step_flags(self.contacts->flags); },
      "StepFlags that touch returned");
  const auto number = [&type](const char* name, auto member, const char* doc) {
    type.def_property_readonly(
        name, [=](const HeldContacts& self) { return self.contacts.get()->*member; }, doc);
  };
  number("step", &palpate_contacts::step, "number of the touch, from 1");
  number("sweeps", &palpate_contacts::sweeps, "sweeps of projected Gauss-Seidel; 0 where none was needed");
  number("newton_steps", &palpate_contacts::newton_steps, "steps of Newton's method; 0 where none was needed");
  number("residual_displacement", &palpate_contacts::residual_displacement,
         "m: by how much the worst contact misses its imposed displacement");
  number("residual_force", &palpate_contacts::residual_force, "N: the same, divided by that contact's own compliance");
  add_mailbox(module);
}

}  // namespace palpate::python
