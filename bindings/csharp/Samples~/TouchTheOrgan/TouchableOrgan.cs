using System;
using System.Diagnostics;
using System.IO;
using System.Threading;
using Palpate;
using Unity.Collections;
using Unity.Collections.LowLevel.Unsafe;
using UnityEngine;

/// <summary>
/// An organ that a probe touches: 1,000 touches a second in a thread of its own, a shape and a mesh for each frame, and no garbage.
/// Place the object's parent: its own transform turns the organ's right-handed frame (x left, y back, z up) into Unity's.
/// </summary>
[RequireComponent(typeof(MeshFilter))]
public sealed unsafe class TouchableOrgan : MonoBehaviour {
  [Tooltip("A bundle, below StreamingAssets")]
  public string bundleFile = "bundle.h5";
  [Tooltip("Its position touches the organ")]
  public Transform probe;
  [Tooltip("m: the disc that the probe presses")]
  public float discRadius = 0.005f;
  [Tooltip("N: what a device may get at most")]
  public float forceLimit = 5;
  [Tooltip("More than 0: the probe slides with Coulomb friction")]
  public float friction = 0;

  /// <summary>N, on the probe, in Unity's world.</summary>
  public Vector3 Force { get; private set; }
  /// <summary>Flags of the newest touch; 0 is a touch that kept all its tolerances.</summary>
  public Palpate.Native.palpate_step_flags Flags { get; private set; }

  Bundle bundle;
  Scene scene;
  Mailbox mailbox;
  Mesh mesh;
  NativeArray<Vector3> vertices, normals;
  Thread thread;
  Tool[] tools;
  readonly object gate = new object();
  Vector3 target;  // of the probe, in the organ's frame; under gate
  volatile bool running;

  void OnEnable() {
    // Exchanges y and z. The reflection also turns the triangles' order into Unity's, so that they stay as they are.
    transform.localRotation = Quaternion.Euler(90, 0, 0);
    transform.localScale = new Vector3(1, 1, -1);
    bundle = Bundle.Open(Path.Combine(Application.streamingAssetsPath, bundleFile));
    var effects =
        new Effects { { "collision", "deformed" }, { "force_limit", forceLimit }, { "force_slew", 100 * forceLimit } };
    if (friction > 0) effects.Add("law", "coulomb");
    scene = new Scene(bundle, effects);
    bundle.Prefault();
    mailbox = new Mailbox(scene);
    tools = new[] { new Tool { Id = 0, DiscRadius = discRadius, Friction = friction } };
    vertices = new NativeArray<Vector3>(scene.ShapeNodeCount, Allocator.Persistent);
    normals = new NativeArray<Vector3>(scene.ShapeNodeCount, Allocator.Persistent);
    MakeMesh();
    target = transform.InverseTransformPoint(probe.position);
    running = true;
    thread = new Thread(Touch) { IsBackground = true, Priority = System.Threading.ThreadPriority.Highest };
    thread.Start();
  }

  void MakeMesh() {
    double[] nodes = bundle.Nodes();
    for (int n = 0; n < vertices.Length; ++n)
      vertices[n] = new Vector3((float)nodes[3 * n], (float)nodes[3 * n + 1], (float)nodes[3 * n + 2]);
    mesh = new Mesh { indexFormat = UnityEngine.Rendering.IndexFormat.UInt32 };
    mesh.MarkDynamic();
    mesh.SetVertices(vertices);
    mesh.SetTriangles(bundle.Triangles(), 0);
    mesh.RecalculateNormals();
    mesh.RecalculateBounds();
    Bounds bounds = mesh.bounds;
    bounds.Expand(0.05f);  // m: room for what the probe pulls out
    mesh.bounds = bounds;
    GetComponent<MeshFilter>().sharedMesh = mesh;
  }

  // The haptic loop. It does not sleep, because the system's shortest sleep may be longer than a millisecond.
  void Touch() {
    long period = Stopwatch.Frequency / 1000, next = Stopwatch.GetTimestamp();
    while (running) {
      lock (gate) tools[0].MoveTo(new Vector(target.x, target.y, target.z));
      scene.Touch(tools, 0.001, mailbox.Slot());
      mailbox.Publish();
      next = Math.Max(next + period, Stopwatch.GetTimestamp() - 20 * period);
      while (running && Stopwatch.GetTimestamp() < next) Thread.Yield();
    }
  }

  void Update() {
    Vector3 position = transform.InverseTransformPoint(probe.position);
    lock (gate) target = position;
    Contacts contacts = mailbox.Newest();
    if (contacts == null) return;
    var positions = (float*)vertices.GetUnsafePtr();
    scene.Shape(contacts, positions, null, vertices.Length);
    scene.Normals(positions, (float*)normals.GetUnsafePtr(), normals.Length);
    mesh.SetVertices(vertices);
    mesh.SetNormals(normals);
    Vector force = contacts.Force(0);
    Force = transform.TransformVector(new Vector3((float)force.X, (float)force.Y, (float)force.Z));
    Flags = contacts.Flags;
  }

  void OnDisable() {
    running = false;
    thread?.Join();
    mailbox?.Dispose();
    scene?.Dispose();
    bundle?.Dispose();
    if (vertices.IsCreated) vertices.Dispose();
    if (normals.IsCreated) normals.Dispose();
    if (mesh != null) Destroy(mesh);
  }
}
