// PackageTest.exe BUNDLE RECORD ABI_LIST BUNDLE_TO_CUT: the package for Unity, under mono, against the library that it holds. RECORD: of palpate-run, for push.toml.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Linq;
using System.Reflection;
using System.Runtime.InteropServices;
using System.Text.RegularExpressions;
using System.Threading;
using Palpate;
using Palpate.Native;
using UnityEngine;
using static Palpate.Native.Api;

static unsafe class PackageTest {
  static string bundleFile, recordFile, abiFile, blockFile;

  static void Check(bool holds, string what) {
    if (!holds) throw new Exception("not so: " + what);
  }

  static T Throws<T>(Action action, string noun)
      where T : Exception {
    try {
      action();
    } catch (T thrown) {
      Check(thrown.Message.Contains(noun), "\"" + thrown.Message + "\" names \"" + noun + "\"");
      return thrown;
    }
    throw new Exception("no " + typeof(T).Name + " that names " + noun);
  }

  static Scene PushedScene(Bundle bundle) => new Scene(bundle, new Effects { { "collision", "deformed" },
                                                                             { "law", "coulomb" },
                                                                             { "force_limit", 2 },
                                                                             { "force_slew", 500 },
                                                                             { "max_tools", 2 },
                                                                             { "max_points", 2 },
                                                                             { "max_contact_nodes", 400 } });

  static Tool[] PushingTools() => new[] { new Tool { Id = 0, DiscRadius = 0.006, Friction = 0.3 },
                                          new Tool { Id = 1, DiscRadius = 0.004, Friction = 0.3 } };

  // XXH64 with the seed 0 (https://github.com/Cyan4973/xxHash/blob/dev/doc/xxhash_spec.md), as in records.
  static ulong Xxh64(byte[] bytes) {
    const ulong p1 = 0x9E3779B185EBCA87, p2 = 0xC2B2AE3D27D4EB4F, p3 = 0x165667B19E3779F9, p4 = 0x85EBCA77C2B2AE63,
                p5 = 0x27D4EB2F165667C5;
    Func<ulong, int, ulong> turned = (x, by) => x << by | x >> (64 - by);
    Func<ulong, ulong, ulong> round = (sum, lane) => turned(sum + lane * p2, 31) * p1;
    int at = 0;
    ulong[] lanes = { unchecked(p1 + p2), p2, 0, unchecked(0 - p1) };
    for (; at + 32 <= bytes.Length; at += 32)
      for (int k = 0; k < 4; ++k) lanes[k] = round(lanes[k], BitConverter.ToUInt64(bytes, at + 8 * k));
    ulong hash = turned(lanes[0], 1) + turned(lanes[1], 7) + turned(lanes[2], 12) + turned(lanes[3], 18);
    foreach (ulong lane in lanes) hash = (hash ^ round(0, lane)) * p1 + p4;
    hash += (ulong)bytes.Length;
    for (; at + 8 <= bytes.Length; at += 8)
      hash = turned(hash ^ round(0, BitConverter.ToUInt64(bytes, at)), 27) * p1 + p4;
    Check(at == bytes.Length, "contacts have a multiple of 8 bytes");
    hash = (hash ^ hash >> 33) * p2;
    hash = (hash ^ hash >> 29) * p3;
    return hash ^ hash >> 32;
  }

  static void ContactsAreThoseOfPalpateRunToTheBit() {
    string record = File.ReadAllText(recordFile);
    string expected = Regex.Match(record, @"# output (\w+)").Groups[1].Value;
    double[][] path =
        Regex.Matches(record, @"\[ ([-0-9.e]+), ([-0-9.e]+), ([-0-9.e]+), ([-0-9.e]+) \]")
            .Cast<Match>()
            .Select(row => Enumerable.Range(2, 3)
                               .Select(k => double.Parse(row.Groups[k].Value, CultureInfo.InvariantCulture))
                               .ToArray())
            .ToArray();
    int touches = path.Length / 2;  // the rows of one tool stand before those of the other
    using (var bundle = Bundle.Open(bundleFile)) using (Scene scene = PushedScene(bundle)) using (
        Contacts contacts = scene.MakeContacts()) {
      Tool[] tools = PushingTools();
      var all = new MemoryStream();
      double most = 0;
      for (int touch = 0; touch < touches; ++touch) {
        for (int t = 0; t < 2; ++t) Array.Copy(path[t * touches + touch], tools[t].Points, 3);
        scene.Touch(tools, 0.001, contacts);
        var bytes = new byte[contacts.Pointer->used_bytes];
        Marshal.Copy((IntPtr)contacts.Pointer, bytes, 0, bytes.Length);
        all.Write(bytes, 0, bytes.Length);
        most = Math.Max(most, contacts.ForceRaw(0).Length);
      }
      Check(touches > 300 && most > 0.01 && contacts.Step == (ulong)touches, "the tools press");
      Check(Xxh64(all.ToArray()).ToString("x16") == expected,
            "the contacts of all touches are those that palpate-run recorded");
    }
  }

  static void StructsLieAsInTheListOfTheAbi() {
    Type type = null;
    int structs = 0, fields = 0;
    foreach (string line in File.ReadLines(abiFile)) {
      Match head = Regex.Match(line, @"^struct (\w+) (\d+) bytes");
      if (head.Success) {
        type = typeof(palpate_tool).Assembly.GetType("Palpate.Native." + head.Groups[1].Value, true);
        Check(Marshal.SizeOf(type) == int.Parse(head.Groups[2].Value), "the size of " + type.Name);
        ++structs;
      }
      Match field = Regex.Match(line, @"^ +(\d+) \+(\d+) +(.*)");
      if (!field.Success) continue;
      Match pointer = Regex.Match(field.Groups[3].Value, @"\(\*(\w+)\)");
      string name = pointer.Success ? pointer.Groups[1].Value
                                    : Regex.Match(field.Groups[3].Value, @"(\w+)(\[\w+\])*$").Groups[1].Value;
      FieldInfo info = type.GetField(name) ?? type.GetField(name + "_0");
      Check(info != null, type.Name + " has " + name);
      Check(Marshal.OffsetOf(type, info.Name).ToInt32() == int.Parse(field.Groups[1].Value),
            "the offset of " + type.Name + "." + name);
      ++fields;
    }
    Check(structs > 50 && fields > 350, "the list has structs and fields");
  }

  static void ConstantsAndFunctionsAreThoseOfTheList() {
    Assembly assembly = typeof(palpate_tool).Assembly;
    Func<string, Type> flags = name =>
        name.StartsWith("DEVICE_") ? typeof(palpate_device_flags) : typeof(palpate_step_flags);
    int functions = 0;
    foreach (string line in File.ReadLines(abiFile)) {
      Match function = Regex.Match(line, @"^function .*?(\w+)\(");
      if (function.Success) {
        MethodInfo method = typeof(Api).GetMethod(function.Groups[1].Value);
        Check(method != null, "there is " + function.Groups[1].Value);
        Marshal.Prelink(method);  // throws where the library has no such function
        ++functions;
      }
      Match constant = Regex.Match(line, @"^constant PALPATE_(\w+) (\d+)(?: of (\w+))?");
      if (!constant.Success) continue;
      string name = constant.Groups[1].Value;
      long value = long.Parse(constant.Groups[2].Value);
      Type of = constant.Groups[3].Success ? assembly.GetType("Palpate.Native." + constant.Groups[3].Value, true)
                                           : flags(name);
      string member = Enum.GetNames(of).Where(name.EndsWith).OrderByDescending(n => n.Length).FirstOrDefault();
      object found =
          typeof(Api).GetField("PALPATE_" + name)?.GetValue(null) ?? (member == null ? null : Enum.Parse(of, member));
      Check(found != null && Convert.ToInt64(found) == value, "the value of PALPATE_" + name);
    }
    Check(functions > 100, "the list has functions");
  }

  static void StepsAllocateNothing() {
    using (var bundle = Bundle.FromBytes(File.ReadAllBytes(bundleFile))) using (
        Scene scene = PushedScene(bundle)) using (var mailbox = new Mailbox(scene)) {
      Check(mailbox.Newest() == null, "a new mailbox is empty");
      Tool[] tools = PushingTools();
      tools[0].TorqueAbout = new Vector();
      var positions = new float[3 * scene.ShapeNodeCount];
      long before = 0;
      int contacts = 0;
      double torque = 0;
      for (int touch = 0; touch < 3000; ++touch) {
        if (touch == 1000) before = GC.GetAllocatedBytesForCurrentThread();
        for (int t = 0; t < 2; ++t) {
          tools[t].Points[0] = 0.03 + 0.012 * t;
          tools[t].Points[1] = 0.025 - 0.01 * t;
          tools[t].Points[2] = 0.039 + 0.002 * Math.Cos(0.01 * touch);
        }
        scene.Touch(tools, 0.001, mailbox.Slot());
        mailbox.Publish();
        Contacts newest = mailbox.Newest();
        scene.Shape(newest, positions);
        contacts += newest.State(0).contact_count;
        torque = Math.Max(torque, newest.Torque(0).Length);
      }
      long allocated = GC.GetAllocatedBytesForCurrentThread() - before;
      Check(allocated == 0, "2,000 steps allocate nothing, found " + allocated + " bytes");
      Check(contacts > 100 && torque > 0, "the tools touch");
      new byte[64].GetHashCode();
      Check(GC.GetAllocatedBytesForCurrentThread() > before, "the counter counts");
    }
  }

  static void WrongSizesAreRefused() {
    using (var bundle = Bundle.Open(bundleFile)) using (Scene scene = PushedScene(bundle)) using (
        var small = new Scene(bundle, new Effects {
          { "max_tools", 1 }, { "max_points", 1 }, { "max_contact_nodes", 3 }
        })) using (Contacts contacts = scene.MakeContacts()) using (Contacts smaller = small.MakeContacts()) {
      Tool[] tools = PushingTools();
      Throws<ArgumentException>(() => scene.Touch(tools, 0.001, smaller), "contacts");
      Throws<ArgumentException>(() => scene.Touch(new Tool[9], 0.001, contacts), "9");
      Throws<ArgumentException>(() => scene.Touch(new[] { new Tool { Points = new double[4] } }, 0.001, contacts), "4");
      Throws<ArgumentException>(() => scene.Shape(contacts, new float[3 * scene.ShapeNodeCount - 1]), "positions");
      Throws<ArgumentException>(() => scene.Shape(contacts, null, new float[2]), "displacements");
      Throws<ArgumentException>(() => scene.Shape(contacts, null, null, scene.ShapeNodeCount - 1), "positions");
      Throws<ArgumentException>(() => scene.Normals(null, null, 1), "normals");
      Throws<ArgumentOutOfRangeException>(() => contacts.State(2), "tools");
      Throws<ArgumentException>(() => new Scene(bundle, new Effects { { "lwa", "coulomb" } }), "lwa");
      Throws<ArgumentException>(() => new Scene(bundle, new Effects { { "law", "kolomb" } }), "kolomb");
      Throws<ArgumentException>(() => new Scene(bundle, null, new Surface { Positions = new float[4] }), "4");
      Check(Throws<PalpateException>(() => new Scene(bundle, new Effects { { "max_tools", 9 } }), "max_tools").Status ==
                palpate_status.ERROR_ARGUMENT,
            "a status");
      palpate_scene_def def = palpate_default_scene_def();
      palpate_scene* made = null;
      palpate_error error;
      def.struct_bytes = 3;
      bundle.Info.GetHashCode();
      Check(palpate_scene_create(scene.Bundle.Handle(), &def, &made, &error) == palpate_status.ERROR_ARGUMENT &&
                made == null,
            "a struct of 3 bytes");
    }
  }

  // The bundle's pointer, which the package keeps for itself.
  static palpate_bundle* Handle(this Bundle bundle) {
    object handle = typeof(Bundle).GetField("Handle", BindingFlags.NonPublic | BindingFlags.Instance).GetValue(bundle);
    return (palpate_bundle*)((SafeHandle)handle).DangerousGetHandle();
  }

  static void ErrorsCarryTheSentenceOfTheLibrary() {
    byte[] bytes = File.ReadAllBytes(bundleFile);
    Check(Throws<PalpateException>(() => Bundle.FromBytes(bytes.Take(bytes.Length / 2).ToArray()), "bytes").Status !=
              palpate_status.OK,
          "half a bundle");
    Check(Throws<PalpateException>(() => Bundle.Open("/no/such/bundle.h5"), "/no/such/bundle.h5").Status ==
              palpate_status.ERROR_FILE,
          "no file");
    for (int k = 0; k < 4096; ++k) bytes[bytes.Length / 2 + k] ^= 1;  // more than the space between two sections
    using (var damaged = Bundle.FromBytes(bytes))
        Check(Throws<PalpateException>(damaged.Check, "").Status == palpate_status.ERROR_CHECKSUM, "changed bytes");
  }

  static void ObjectsMayEndInAnyOrder() {
    var bundle = Bundle.FromBytes(File.ReadAllBytes(bundleFile));
    Scene scene = PushedScene(bundle);
    Contacts contacts = scene.MakeContacts();
    bundle.Dispose();
    Tool[] tools = PushingTools();
    Check(scene.Touch(tools, 0.001, contacts) == 0, "a scene keeps its bundle");
    scene.Dispose();
    scene.Dispose();
    Throws<ObjectDisposedException>(() => bundle.Nodes(), "");
    Throws<ObjectDisposedException>(() => scene.Touch(tools, 0.001, contacts), "");
    Throws<ObjectDisposedException>(scene.Reset, "");
    contacts.Dispose();
    Throws<ObjectDisposedException>(() => contacts.Force(0), "");
    // What nobody disposes of, the collector does.
    for (int k = 0; k < 20; ++k) PushedScene(Bundle.FromBytes(File.ReadAllBytes(bundleFile))).MakeContacts();
    GC.Collect();
    GC.WaitForPendingFinalizers();
  }

  static void ASecondThreadInOneHalfIsRefused() {
    using (var bundle = Bundle.Open(bundleFile)) using (Scene scene = PushedScene(bundle)) using (
        Contacts contacts = scene.MakeContacts()) {
      FieldInfo running = typeof(Scene).GetField("touches", BindingFlags.NonPublic | BindingFlags.Instance);
      running.SetValue(scene, 1);  // as in the midst of a touch
      Throws<InvalidOperationException>(() => scene.Touch(PushingTools(), 0.001, contacts), "thread");
      Check(scene.Shape(contacts, null) != palpate_step_flags.UNSOLVED, "the other half runs");
      running.SetValue(scene, 0);
      Check(scene.Touch(PushingTools(), 0.001, contacts) == 0, "then the touch runs");
    }
  }

  static void FinerSurfacesGripsGraspsAndEventsWork() {
    using (var bundle = Bundle.Open(bundleFile)) {
      int surface = bundle.Info.surface_node_count;
      float[] positions = bundle.Nodes().Take(3 * surface).Select(x => (float)x).ToArray();
      var finer = new Surface { Positions = positions, Normals = positions, Triangles = bundle.Triangles() };
      using (var scene = new Scene(bundle, new Effects { { "report", "contacts" }, { "grasps", true } }, finer,
                                   finer)) using (Contacts contacts = scene.MakeContacts()) {
        GC.Collect();
        int node = bundle.Touchable()[bundle.Info.touchable_count / 2];
        palpate_grip grip = palpate_default_grip();
        grip.kind = palpate_grip_kind.NODE;
        grip.node = node;
        grip.displacement[2] = -0.002;
        var tool = new Tool { Points = null, Grips = new[] { grip } };
        Check(scene.Touch(new[] { tool }, 0.001, contacts) == 0, "a grip is no error");
        Check(contacts.ForceRaw(0).Length > 0 && contacts.Node(0).node == node, "the grip holds its node");
        var displacements = new float[3 * scene.ShapeNodeCount];
        var skin = new float[3 * scene.SkinVertexCount];
        var normals = new float[3 * scene.SkinVertexCount];
        Check(scene.Shape(contacts, null, displacements) == 0 && scene.Skin(displacements, skin, normals) == 0,
              "the finer surface follows");
        Check(Math.Abs(skin[3 * node + 2] - positions[3 * node + 2] + 0.002) < 1e-6,
              "its vertex is where the grip holds it");
        Check(palpate_report_event(palpate_scene_report(scene.Pointer), 0)->kind == palpate_contact_event_kind.BEGIN,
              "an event tells it");
        palpate_grasp grasp = palpate_default_grasp();
        grasp.triangle = Enumerable.Range(0, bundle.Info.triangle_count)
                             .First(f => finer.Triangles.Skip(3 * f).Take(3).All(bundle.Touchable().Contains));
        grasp.barycentric[0] = 1;
        grasp.radius = 0.003;
        var jaws = new Tool { Id = 1, Points = null, Grasp = grasp };
        scene.Touch(new[] { jaws }, 0.001, contacts);
        Check(palpate_scene_grasp_state(scene.Pointer, 1)->condition == palpate_grasp_condition.HOLDS, "the jaws hold");
      }
    }
  }

  static void ObstaclesHoldTheOrganOffAndMove() {
    using (var bundle = Bundle.Open(bundleFile)) {
      var down = new Turn(0, 1, 0, 0);
      Obstacle plate = Obstacle.Rectangle(0.1, 0.1);
      plate.Friction = 0.3;
      plate.Position = new Vector(0.03, 0.025, 0.0405);
      plate.Orientation = down;
      Obstacle far = Obstacle.OfMesh(
          new Surface { Positions = new float[] { 1, 0, 0, 0, 1, 0, 0, 0, 1 }, Triangles = new[] { 0, 1, 2 } });
      far.Position = new Vector(5, 0, 0);
      var effects = new Effects { { "collision", "deformed" }, { "obstacle_nodes", 100 } };
      using (var scene = new Scene(bundle, effects, obstacles: new[] { plate, far })) using (Contacts contacts =
                                                                                                 scene.MakeContacts()) {
        GC.Collect();
        for (int step = 0; step <= 40; ++step) {
          scene.SetObstaclePose(0, new Vector(0.03, 0.025, 0.0405 - 5e-5 * step), down);
          Check(scene.Touch(new Tool[0], 0.001, contacts) == 0, "a plate is no error");
        }
        ObstacleState state = scene.StateOfObstacle(0);
        Check(state.Nodes > 0 && state.Force.Z > 0.05 && state.Torque.Length > 0, "the organ presses the plate");
        Check(Math.Abs(state.Position.Z - 0.0385) < 1e-12, "it is where it was sent");
        Check(scene.StateOfObstacle(1).Nodes == 0, "what is far presses nothing");
        Throws<ArgumentException>(() => scene.StateOfObstacle(2), "obstacle 2");
        Throws<PalpateException>(() => scene.SetObstaclePose(2, new Vector(0, 0, 0)), "found 2 of 2");
      }
      Throws<PalpateException>(
          () => new Scene(bundle, new Effects { { "collision", "rest" } }, obstacles: new[] { plate }), "DEFORMED");
      Throws<PalpateException>(() => new Scene(bundle, effects, obstacles: new[] { new Obstacle() }), "a kind");
    }
  }

  static bool IsClosed(int[] triangles) {
    var edges = new HashSet<long>();
    for (int t = 0; t < triangles.Length; t += 3)
      for (int v = 0; v < 3; ++v)
        if (!edges.Add(((long)triangles[t + v] << 32) + triangles[t + (v + 1) % 3])) return false;
    return edges.All(edge => edges.Contains((edge << 32) + (edge >> 32)));
  }

  static void ABladeCutsABlockInTwo() {
    using (var bundle = Bundle.Open(blockFile)) {
      var effects = new Effects {
        { "collision", "deformed" }, { "contact", "point" }, { "cut", "on" }, { "cut_operations", 1000000000 }
      };
      using (var scene = new Scene(bundle, effects)) using (Contacts contacts = scene.MakeContacts()) {
        int whole = scene.CutSurface(null);
        Check(whole == bundle.Info.triangle_count, "before a cut the surface is the bundle's");
        ulong before = scene.StateOfCut().Surface;
        var triangles = new int[3 * whole];
        var isLip = new byte[whole];
        for (int step = 0; step <= 60; ++step) {
          double y = -0.005 + 0.001 * step;
          scene.SetBlade(0, new[] { 0.04, y, -0.01, 0.04, y, 0.01, 0.04, y, 0.03, 0.04, y, 0.05 });
          Check(scene.Touch(new Tool[0], 0.001, contacts) == 0, "a blade is no error");
          int count = scene.CutSurface(null);
          Array.Resize(ref triangles, 3 * count);
          Array.Resize(ref isLip, count);
          Check(scene.CutSurface(triangles, isLip) == count && IsClosed(triangles), "the surface is closed");
        }
        CutState state = scene.StateOfCut();
        Check(state.Pieces == 2 && state.Waiting == 0 && state.Left == 0 && !state.IsFull, "the block is cut in two");
        Check(state.Surface > before && Math.Abs(state.Area - 0.05 * 0.04) < 2e-5, "along the plane");
        Check(isLip.Sum(lip => lip) == 2 * state.Faces, "a face has two lips");
        scene.WithdrawBlade(0);
        scene.RemoveTissue(new Vector(0.02, 0.025, 0.04), 0.015);
        scene.Touch(new Tool[0], 0.001, contacts);
        Check(scene.StateOfCut().Removed > 0, "tissue is removed");
        Throws<PalpateException>(() => scene.SetBlade(4, new double[6]), "PALPATE_MAX_BLADES");
        Throws<PalpateException>(() => scene.SetBlade(0, new double[] { 0, 0, 0, 0, 0, 1 }, toughness: 1), "");
        Throws<PalpateException>(() => scene.RemoveTissue(new Vector(0, 0, 0), 0), "");
        Throws<ArgumentException>(() => scene.StateOfBlade(4), "blade 4");
      }
      using (var scene = new Scene(bundle, effects)) using (Contacts contacts = scene.MakeContacts()) {
        for (int step = 0; step <= 35; ++step) {
          double y = -0.005 + 0.001 * step;
          scene.SetBlade(0, new[] { 0.04, y, -0.01, 0.04, y, 0.01, 0.04, y, 0.03, 0.04, y, 0.05 }, new Vector(0, 1, 0),
                         20, 100, 0.01);
          scene.Touch(new Tool[0], 0.001, contacts);
        }
        BladeState blade = scene.StateOfBlade(0);
        Check(blade.Force.Y < -0.1 && blade.Work > 0 && blade.FrictionWork > 0 && blade.InTissue > 0,
              "the blade feels the tissue");
      }
      using (var scene = new Scene(bundle)) Throws<ArgumentException>(() => scene.StateOfCut(), "does not cut");
    }
  }

  static void TheSampleFeelsAndDraws() {
    Application.streamingAssetsPath = Path.GetDirectoryName(bundleFile);
    var probe = new Transform { position = new Vector3(0.04f, 0.043f, 0.025f) };  // y is up in Unity
    var organ = new TouchableOrgan { bundleFile = Path.GetFileName(bundleFile), probe = probe };
    Func<string, Action> call = name => (Action)Delegate.CreateDelegate(
        typeof(Action), organ, typeof(TouchableOrgan).GetMethod(name, BindingFlags.NonPublic | BindingFlags.Instance));
    call("OnEnable")();
    Action update = call("Update");
    Mesh mesh = organ.filter.sharedMesh;
    long before = 0;
    float most = 0;
    for (int frame = 0; frame < 400 && (frame < 60 || most == 0); ++frame) {
      if (frame == 20) before = GC.GetAllocatedBytesForCurrentThread();
      probe.position = new Vector3(0.04f, Math.Max(0.035f, 0.043f - 0.0005f * frame), 0.025f);
      update();
      most = Math.Max(most, organ.Force.y);
      Thread.Sleep(5);
    }
    Check(GC.GetAllocatedBytesForCurrentThread() == before, "a frame allocates nothing");
    Check(most > 0, "the organ pushes the probe up");
    Check(mesh.uploads > 60, "the mesh is uploaded");
    call("OnDisable")();
  }

  static int Main(string[] arguments) {
    bundleFile = arguments[0];
    recordFile = arguments[1];
    abiFile = arguments[2];
    blockFile = arguments[3];
    int failed = 0;
    foreach (Action test in new Action[] { StructsLieAsInTheListOfTheAbi, ConstantsAndFunctionsAreThoseOfTheList,
                                           ContactsAreThoseOfPalpateRunToTheBit, StepsAllocateNothing,
                                           WrongSizesAreRefused, ErrorsCarryTheSentenceOfTheLibrary,
                                           ObjectsMayEndInAnyOrder, ASecondThreadInOneHalfIsRefused,
                                           FinerSurfacesGripsGraspsAndEventsWork, ObstaclesHoldTheOrganOffAndMove,
                                           ABladeCutsABlockInTwo, TheSampleFeelsAndDraws }) {
      try {
        test();
        Console.WriteLine("ok     " + test.Method.Name);
      } catch (Exception error) {
        Console.WriteLine("FAILED " + test.Method.Name + ": " + error);
        ++failed;
      }
    }
    return failed;
  }
}
