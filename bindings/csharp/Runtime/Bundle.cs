using System;
using System.Runtime.InteropServices;
using System.Text;
using Palpate.Native;
using static Palpate.Native.Api;

namespace Palpate {
  /// <summary>What the library refused, in its own sentence.</summary>
  public sealed class PalpateException : Exception {
    public palpate_status Status { get; }
    /// <summary>Where in the bundle, for a damaged one.</summary>
    public ulong ByteOffset { get; }

    PalpateException(palpate_status status, ulong byteOffset, string sentence) : base(sentence) {
      Status = status;
      ByteOffset = byteOffset;
    }

    internal static unsafe void ThrowIfFailed(palpate_status status, palpate_error* error) {
      if (status == palpate_status.OK) return;
      throw new PalpateException(status, error->byte_offset, Text(error->text));
    }

    /// <summary>A text of the library: UTF-8, ends with a zero byte.</summary>
    internal static unsafe string Text(byte* text) {
      int length = 0;
      while (text[length] != 0) ++length;
      return Encoding.UTF8.GetString(text, length);
    }
  }

  /// <summary>Memory outside the collector, zeroed, at an address divisible by 64.</summary>
  sealed unsafe class Memory : SafeHandle {
    readonly void* aligned;

    internal Memory(ulong bytes) : base(IntPtr.Zero, true) {
      handle = Marshal.AllocHGlobal((IntPtr)(long)(bytes + 64));
      aligned = (void*)(((ulong)handle + 63) & ~63ul);
      for (ulong b = 0; b < bytes; ++b) ((byte*)aligned)[b] = 0;
    }

    internal void* Pointer =>
        IsClosed ? throw new ObjectDisposedException("contacts, tools or bytes of Palpate") : aligned;
    public override bool IsInvalid => handle == IntPtr.Zero;

    protected override bool ReleaseHandle() {
      Marshal.FreeHGlobal(handle);
      return true;
    }
  }

  /// <summary>An object of the library that ends once nobody uses it: neither the host nor a step in another thread.</summary>
  abstract unsafe class Handle : SafeHandle {
    protected Handle() : base(IntPtr.Zero, true) {}
    public override bool IsInvalid => handle == IntPtr.Zero;
    internal void Set(void* pointer) => handle = (IntPtr)pointer;
    internal void* Pointer => (void*)handle;

    /// <summary>Keeps the object until Unlock, or throws ObjectDisposedException.</summary>
    internal void* Lock() {
      bool added = false;
      DangerousAddRef(ref added);
      return (void*)handle;
    }

    internal void Unlock() => DangerousRelease();
  }

  sealed unsafe class BundleHandle : Handle {
    Memory bytes;  // of a bundle from memory

    // Keeps the bytes until the bundle is closed, also where the collector finds both at once.
    internal void Keep(Memory copy) {
      bool added = false;
      copy.DangerousAddRef(ref added);
      bytes = copy;
    }

    protected override bool ReleaseHandle() {
      palpate_bundle_close((palpate_bundle*)handle);
      bytes?.DangerousRelease();
      bytes?.Dispose();
      return true;
    }
  }

  /// <summary>An organ: its mesh and its tensors, read-only. Any thread may use it. It stays open as long as a scene of it exists.</summary>
  public sealed unsafe class Bundle : IDisposable {
    internal readonly BundleHandle Handle = new BundleHandle();
    /// <summary>Counts, and what the bundle has.</summary>
    public palpate_bundle_info Info { get; private set; }

    Bundle() {}

    /// <summary>Opens a file. Its sections are mapped when a scene first needs them.</summary>
    public static Bundle Open(string path) {
      if (path == null) throw new ArgumentNullException(nameof(path));
      var bundle = new Bundle();
      palpate_bundle* opened = null;
      palpate_error error;
      fixed(byte* name = Encoding.UTF8.GetBytes(path + "\0"))
          PalpateException.ThrowIfFailed(palpate_bundle_open_file(name, null, &opened, &error), &error);
      return bundle.With(opened);
    }

    /// <summary>Opens a copy of a file's bytes: of an asset, of a download.</summary>
    public static Bundle FromBytes(byte[] bytes) {
      if (bytes == null) throw new ArgumentNullException(nameof(bytes));
      var copy = new Memory((ulong)bytes.LongLength);
      Marshal.Copy(bytes, 0, (IntPtr)copy.Pointer, bytes.Length);
      palpate_bundle* opened = null;
      palpate_error error;
      palpate_status status = palpate_bundle_open(copy.Pointer, (ulong)bytes.LongLength, null, &opened, &error);
      if (status != palpate_status.OK) copy.Dispose();
      PalpateException.ThrowIfFailed(status, &error);
      var bundle = new Bundle();
      bundle.Handle.Keep(copy);
      return bundle.With(opened);
    }

    Bundle With(palpate_bundle* opened) {
      Handle.Set(opened);
      Info = palpate_bundle_describe(opened);
      return this;
    }

    /// <summary>Compares all bytes with their checksums.</summary>
    public void Check() {
      var bundle = (palpate_bundle*)Handle.Lock();
      palpate_error error;
      palpate_status status = palpate_bundle_check(bundle, &error);
      Handle.Unlock();
      PalpateException.ThrowIfFailed(status, &error);
    }

    /// <summary>Reads what scenes have mapped into memory, so that no step waits for the disk.</summary>
    public void Prefault(bool keep = false) {
      var bundle = (palpate_bundle*)Handle.Lock();
      palpate_error error;
      palpate_status status = palpate_bundle_prefault(bundle, keep ? 1 : 0, &error);
      Handle.Unlock();
      PalpateException.ThrowIfFailed(status, &error);
    }

    /// <summary>A copy of the positions as meshed: x, y, z of each node, m. The first Info.surface_node_count lie on the surface.</summary>
    public double[] Nodes() {
      var copy = new double[3 * Info.node_count];
      var from = palpate_bundle_nodes((palpate_bundle*)Handle.Lock());
      if (from != null) Marshal.Copy((IntPtr)from, copy, 0, copy.Length);
      Handle.Unlock();
      return copy;
    }

    /// <summary>A copy of the surface: three nodes of each triangle, counter-clockwise from outside.</summary>
    public int[] Triangles() {
      var copy = new int[3 * Info.triangle_count];
      var from = palpate_bundle_triangles((palpate_bundle*)Handle.Lock());
      if (from != null) Marshal.Copy((IntPtr)from, copy, 0, copy.Length);
      Handle.Unlock();
      return copy;
    }

    /// <summary>A copy of the list of nodes that may be touched.</summary>
    public int[] Touchable() {
      var copy = new int[Info.touchable_count];
      var from = palpate_bundle_touchable((palpate_bundle*)Handle.Lock());
      if (from != null) Marshal.Copy((IntPtr)from, copy, 0, copy.Length);
      Handle.Unlock();
      return copy;
    }

    public void Dispose() => Handle.Dispose();
  }
}
