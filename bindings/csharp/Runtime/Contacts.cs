using System;
using Palpate.Native;
using static Palpate.Native.Api;

namespace Palpate {
  /// <summary>What a touch found. Each loop has its own; a Mailbox passes them from one thread to another.</summary>
  public sealed unsafe class Contacts : IDisposable {
    readonly Memory memory;  // its own, or its mailbox's
    internal palpate_contacts* At;
    internal readonly ulong Bytes;

    internal Contacts(ulong bytes) {
      memory = new Memory(bytes);
      At = (palpate_contacts*)memory.Pointer;
      Bytes = bytes;
    }

    internal Contacts(ulong bytes, Memory of) {
      memory = of;
      Bytes = bytes;
    }

    /// <summary>For the functions of Palpate.Native.Api. Valid until Dispose.</summary>
    public palpate_contacts* Pointer => memory.Pointer == null ? null : At;
    public palpate_step_flags Flags => (palpate_step_flags)Pointer->flags;
    public int ToolCount => Pointer->tool_count;
    public int NodeCount => Pointer->node_count;
    /// <summary>Touches of the scene so far.</summary>
    public ulong Step => Pointer->step;

    /// <summary>A copy of all that the step tells of a tool.</summary>
    public palpate_tool_state State(int tool) {
      if (tool < 0 || tool >= ToolCount)
        throw new ArgumentOutOfRangeException(nameof(tool), "the contacts have " + ToolCount + " tools");
      return *palpate_contacts_tool(At, tool);
    }

    /// <summary>N, on the tool, within the scene's limits: for a device.</summary>
    public Vector Force(int tool) {
      palpate_tool_state state = State(tool);
      return new Vector(state.force);
    }

    /// <summary>N, on the tool, as computed: for measuring.</summary>
    public Vector ForceRaw(int tool) {
      palpate_tool_state state = State(tool);
      return new Vector(state.force_raw);
    }

    /// <summary>N m, about Tool.TorqueAbout, within the scene's limits.</summary>
    public Vector Torque(int tool) {
      palpate_tool_state state = State(tool);
      return new Vector(state.torque);
    }

    /// <summary>A copy of a node under contact.</summary>
    public palpate_contact_node Node(int node) {
      if (node < 0 || node >= NodeCount)
        throw new ArgumentOutOfRangeException(nameof(node), "the contacts have " + NodeCount + " nodes");
      return *palpate_contacts_node(At, node);
    }

    // Keeps the memory during a step, or throws ObjectDisposedException.
    internal void Lock(ref bool locked) => memory.DangerousAddRef(ref locked);
    internal void Unlock() => memory.DangerousRelease();

    public void Dispose() => memory.Dispose();
  }

  /// <summary>Hands the newest contacts from the thread that touches to the thread that shapes; neither waits.</summary>
  public sealed unsafe class Mailbox : IDisposable {
    readonly Memory memory;
    readonly palpate_mailbox* box;
    readonly Contacts slot, newest;

    public Mailbox(Scene scene) {
      ulong bytes = scene.ContactsBytes;
      memory = new Memory(palpate_mailbox_bytes(bytes));
      box = palpate_mailbox_create(memory.Pointer, bytes);
      slot = new Contacts(bytes, memory);
      newest = new Contacts(bytes, memory);
    }

    /// <summary>For the touching thread: where the next touch writes. The same object each time.</summary>
    public Contacts Slot() {
      if (memory.Pointer != null) slot.At = palpate_mailbox_slot(box);
      return slot;
    }

    /// <summary>For the touching thread: what the slot holds is the newest from now on.</summary>
    public void Publish() {
      if (memory.Pointer != null) palpate_mailbox_publish(box);
    }

    /// <summary>For the shaping thread: the newest contacts, which are its own until the next call; null before the first ones.</summary>
    public Contacts Newest() {
      if (memory.Pointer != null) newest.At = palpate_mailbox_newest(box, null);
      return newest.At == null ? null : newest;
    }

    public void Dispose() => memory.Dispose();
  }
}
