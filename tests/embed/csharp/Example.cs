using System;
using System.Linq;
using Palpate;

static class Example {
  static void Main(string[] arguments) {
    using (var bundle = Bundle.Open(arguments[0])) using (
        var scene = new Scene(bundle, new Effects {
          { "collision", "deformed" }, { "law", "coulomb" }, { "force_limit", 5 }
        })) using (Contacts contacts = scene.MakeContacts()) {
      // A disc of 2 mm radius meets the middle of a triangle, along its normal: from 5 mm above the surface to 5 mm below.
      int touchable = bundle.Touchable()[bundle.Info.touchable_count / 2];
      int[] triangles = bundle.Triangles();
      int first = Array.IndexOf(triangles, touchable) / 3 * 3;
      double[] nodes = bundle.Nodes();
      Vector[] v = Enumerable.Range(first, 3)
                       .Select(k => 3 * triangles[k])
                       .Select(n => new Vector(nodes[n], nodes[n + 1], nodes[n + 2]))
                       .ToArray();
      Vector normal = Vector.Cross(v[1] - v[0], v[2] - v[0]), middle = (v[0] + v[1] + v[2]) * (1 / 3.0);
      normal = normal * (1 / normal.Length);

      Tool[] tools = { new Tool { DiscRadius = 0.002, Friction = 0.2 } };
      for (int ms = 0; ms <= 1000; ++ms) {  // the haptic loop, 1 kHz
        tools[0].MoveTo(middle + normal * (0.005 - 1e-5 * ms));
        var flags = scene.Touch(tools, 0.001, contacts);
        if (ms % 100 == 0) Console.WriteLine("{0,4} ms  {1:0.0000} N  flags {2}", ms, contacts.Force(0).Length, flags);
      }
      var positions = new float[3 * scene.ShapeNodeCount];  // the render loop, 60 Hz
      scene.Shape(contacts, positions);
    }
  }
}
