// As much of Unity as the package's sample calls, so that mono compiles and runs it: no engine, no drawing.
using System;
using System.Runtime.InteropServices;

namespace UnityEngine {
  public class Object {
    public static void Destroy(Object that) {}
  }

  public class MonoBehaviour : Object {
    public readonly Transform transform = new Transform();
    public readonly MeshFilter filter = new MeshFilter();
    public T GetComponent<T>()
        where T : class => filter as T; }

  public class MeshFilter : Object {
      public Mesh sharedMesh;
    }

    public struct Vector3 {
      public float x, y, z;

      public Vector3(float x, float y, float z) {
        this.x = x;
        this.y = y;
        this.z = z;
      }
    }

    public struct Quaternion {
      public static Quaternion Euler(float x, float y, float z) => new Quaternion();
    }

    // Of the sample alone, whose rotation and scale together exchange y and z.
    public class Transform : Object {
      public Vector3 position, localScale;
      public Quaternion localRotation;
      public Vector3 InverseTransformPoint(Vector3 world) => new Vector3(world.x, world.z, world.y);
      public Vector3 TransformVector(Vector3 local) => new Vector3(local.x, local.z, local.y);
    }

    public struct Bounds {
      public void Expand(float by) {}
    }

    public class Mesh : Object {
      public Rendering.IndexFormat indexFormat;
      public Bounds bounds;
      public int uploads;
      public void MarkDynamic() {}
      public void SetVertices(Unity.Collections.NativeArray<Vector3> vertices) => ++uploads;
      public void SetNormals(Unity.Collections.NativeArray<Vector3> normals) => ++uploads;
      public void SetTriangles(int[] triangles, int submesh) {}
      public void RecalculateNormals() {}
      public void RecalculateBounds() {}
    }

    public static class Application { public static string streamingAssetsPath; }

    public sealed class RequireComponent : Attribute {
      public RequireComponent(Type type) {}
    }

    public sealed class TooltipAttribute : Attribute {
      public TooltipAttribute(string text) {}
    }
  }

  namespace UnityEngine.Rendering {
    public enum IndexFormat { UInt16, UInt32 }
  }

  namespace Unity.Collections {
    public enum Allocator { Persistent }

    public unsafe struct NativeArray<T> : IDisposable
        where T : struct {
      internal IntPtr Memory;
      public int Length { get; private set; }
      public bool IsCreated => Memory != IntPtr.Zero;

      public NativeArray(int length, Allocator allocator) {
        Memory = Marshal.AllocHGlobal(length * Marshal.SizeOf(typeof(T)));
        Length = length;
      }

      public T this[int at] {
        set {
          Marshal.StructureToPtr(value, Memory + at * Marshal.SizeOf(typeof(T)), false);
        }
        get {
          return (T)Marshal.PtrToStructure(Memory + at * Marshal.SizeOf(typeof(T)), typeof(T));
        }
      }

      public void Dispose() {
        Marshal.FreeHGlobal(Memory);
        Memory = IntPtr.Zero;
      }
    }
  }

  namespace Unity.Collections.LowLevel.Unsafe {
    public static class NativeArrayUnsafeUtility {
      public static unsafe void* GetUnsafePtr<T>(this NativeArray<T> array)
          where T : struct => (void*) array.Memory; } }
