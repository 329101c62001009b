using System;
using System.Collections;
using System.Collections.Generic;
using Palpate.Native;
using static Palpate.Native.Api;

namespace Palpate {
  /// <summary>Effects and limits of a scene by the names that scene files have: <c>new Effects { { "law", "coulomb" }, { "force_limit", 5 } }</c>.</summary>
  public sealed unsafe class Effects : IEnumerable {
    readonly List<KeyValuePair<string, object>> values = new List<KeyValuePair<string, object>>();

    public void Add(string key, string word) => values.Add(new KeyValuePair<string, object>(key, word));
    public void Add(string key, double number) => values.Add(new KeyValuePair<string, object>(key, number));
    public void Add(string key, bool on) => Add(key, on? 1: 0);
    public IEnumerator GetEnumerator() => values.GetEnumerator();

    internal void Set(palpate_scene_def* def) {
      foreach (KeyValuePair<string, object> value in values) {
        palpate_key* key = Find(value.Key);
        double number = value.Value is string word ? IndexOf(key, word) : (double)value.Value;
        if (palpate_set_key(key, def, number) == 0)
          throw new ArgumentException(value.Key + ": is no number; see the arguments of Scene");
      }
    }

    internal static palpate_key* Find(string name) {
      var names = new List<string>();
      for (int k = 0;; ++k) {
        palpate_key* key = palpate_scene_key(k);
        if (key == null) break;
        names.Add(PalpateException.Text(key->name));
        if (names[k] == name) return key;
      }
      throw new ArgumentException("no effect has the name " + name + "; the names are " + string.Join(", ", names));
    }

    static double IndexOf(palpate_key* key, string word) {
      string words = PalpateException.Text(key->words);
      int at = key->type == palpate_key_type.CHOICE
                   ? Array.IndexOf(words.Split(new[] { ", " }, StringSplitOptions.None), word)
                   : -1;
      if (at >= 0) return at;
      throw new ArgumentException(PalpateException.Text(key->name) + ": expected " +
                                  (key->type == palpate_key_type.CHOICE ? "one of " + words : "a number") + ", found " +
                                  word);
    }
  }

  /// <summary>A surface that is finer than the bundle's mesh. Positions and normals: x, y, z of each vertex; triangles: three vertices of each.</summary>
  public sealed class Surface {
    public float[] Positions, Normals;
    public int[] Triangles;
  }
}
