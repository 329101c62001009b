// The keys of palpate_scene_def and the descriptors of the effects: what they say, and what hosts print from them.
#include <fmt/ranges.h>

#include <fstream>
#include <set>
#include <sstream>

#include "runtime/complete/effects.h"
#include "tests/runtime/asked_scene.h"
#include "tests/runtime/touched_box.h"
#include "tests/support/test_files.h"

namespace palpate::tests {
namespace {

// Reads a file of the sources.
std::string source(const std::string& file) {
  return file_bytes(std::filesystem::path(PALPATE_SOURCE_FOLDER) / file);
}

template <class Each>
void for_each_key(Each each) {
  for (std::int32_t k = 0; const palpate_key* key = palpate_scene_key(k); ++k) each(*key);
}

std::vector<std::string> words_of(const palpate_key& key) {
  std::vector<std::string> words;
  std::istringstream list(key.words);
  for (std::string word; std::getline(list >> std::ws, word, ',');) words.push_back('"' + word + '"');
  return words;
}

TEST(Descriptors, HaveNamesAndFieldsOfTheirOwn) {
  std::set<std::string> names;
  std::map<const Effect*, std::vector<int>> owners;  // [bytes of the struct]; nullptr: palpate_scene_def
  owners[nullptr].resize(sizeof(palpate_scene_def));
  for (const Effect* effect : all_effects()) {
    EXPECT_TRUE(names.insert(effect->name).second) << effect->name;
    EXPECT_TRUE(effect->build || effect->prepare) << effect->name;
    EXPECT_FALSE(effect->keys.empty()) << effect->name;
    for (const EffectKey& key : effect->keys) EXPECT_EQ(key.effect, effect) << key.name;
    owners[effect].resize(effect->def.sizes.known);
  }
  std::set<std::string> names_of_keys;  // a host gives them without the effect's name
  for_each_key([&](const palpate_key& key) { EXPECT_TRUE(names_of_keys.insert(key.name).second) << key.name; });
  std::size_t keys = core_keys().size();
  for (const Effect* effect : all_effects()) keys += effect->keys.size();
  for_each_key([&](const palpate_key& key) {
    const auto begin = static_cast<std::size_t>(key.offset), end = begin + static_cast<std::size_t>(key.bytes);
    std::vector<int>& owner = owners.at(key.effect);
    ASSERT_LE(end, owner.size()) << key.name;
    for (std::size_t b = begin; b < end; ++b) EXPECT_EQ(owner[b]++, 0) << key.name;
    --keys;
  });
  EXPECT_EQ(keys, 0u);
  EXPECT_EQ(palpate_scene_key(-1), nullptr);
  // Of a field without a key a saved state would not know. Its own size, what is reserved, and the chain have none; nor do the other fields of
  // effects that stand for an array of the host.
  for (const auto& [effect, owner] : owners) {
    const std::ptrdiff_t without =
        effect ? sizeof(palpate_part) : sizeof(std::uint32_t) + sizeof(std::int32_t) + sizeof(const palpate_part*);
    if (effect && effect->keys[0].type == PALPATE_KEY_POINTER) continue;
    EXPECT_LE(std::count(owner.begin(), owner.end(), 0), without + (effect ? 4 : 0))
        << (effect ? effect->name : "core");
  }
}

// Without a part of it an effect is off; a part of palpate_add_all_parts is, too; and each is on in the struct that a host begins with, but for
// those that need a number or an array.
TEST(Descriptors, SayWhatSwitchesAnEffect) {
  palpate_scene_def def = palpate_default_scene_def();
  const SceneDef whole;
  std::vector<std::uint64_t> memory(palpate_all_parts_bytes() / 8);
  palpate_scene_def by_name = def;
  palpate_add_all_parts(&by_name, memory.data());
  for (const Effect* effect : all_effects()) {
    const EffectKey& first = effect->keys[0];
    EXPECT_EQ(palpate_key_number(&first, &def), 0) << effect->name;
    EXPECT_EQ(palpate_key_number(&first, &whole), 0) << effect->name;
    EXPECT_EQ(palpate_key_number(&first, &by_name), 0) << effect->name;
    EXPECT_EQ(palpate_set_key(&first, &def, 1), 0) << effect->name;
    alignas(8) unsigned char bytes[kMostPartBytes] = {};
    effect->def.init(bytes, effect->def.sizes.known);
    auto* const part = reinterpret_cast<palpate_part*>(bytes);
    EXPECT_EQ(part->effect, effect) << effect->name;
    palpate_scene_def own = def;
    palpate_add_part(&own.parts, part);
    const bool needs_a_choice = first.type == PALPATE_KEY_POINTER || first.type == PALPATE_KEY_COUNT;
    EXPECT_EQ(palpate_key_number(&first, &own), needs_a_choice ? 0 : 1) << effect->name;
  }
}

// Every choice has as many words as values, and every reason is a sentence that names what to do.
TEST(Descriptors, SayWordsOfAllValuesAndReasons) {
  for_each_key([](const palpate_key& key) {
    if (key.type != PALPATE_KEY_CHOICE) return;
    EXPECT_EQ(words_of(key).size(), key.most + 1) << key.name;
  });
  for (const Effect* effect : all_effects())
    for (const EffectNeed& need : effect->needs) {
      EXPECT_GT(std::string(need.reason).size(), 20u) << effect->name;
      EXPECT_NE(need.values, 0u) << effect->name;
    }
}

// Every field of the core is refused by its name outside of its limits.
TEST(Descriptors, SayTheLimitsOfTheCore) {
  const TouchedBox box;
  for (const EffectKey& key : core_keys()) {
    if (key.type == PALPATE_KEY_POINTER) continue;
    for (const double value : {key.least - 1, key.most + 1, static_cast<double>(NAN)}) {
      if (value > 1e300) continue;
      SceneDef def;
      palpate_set_key(&key, &def, value);
      EXPECT_THAT(refusal_of(box, def).text, testing::HasSubstr(std::string("palpate_scene_def: ") + key.name));
    }
  }
}

// A host whose header is older has a smaller struct.
TEST(Descriptors, DoNotReachBeyondTheHostsStruct) {
  for_each_key([&](const palpate_key& key) {
    SceneDef def;
    std::uint32_t& bytes =
        key.effect ? const_cast<palpate_part*>(find_part(def, *key.effect))->struct_bytes : def.struct_bytes;
    bytes = static_cast<std::uint32_t>(key.offset);
    EXPECT_EQ(palpate_set_key(&key, &def, 1), 0) << key.name;
    EXPECT_EQ(palpate_key_number(&key, &def), 0) << key.name;
  });
}

// A value outside of its limits is refused by its name, and one that the effect excludes with the reason.
TEST(Descriptors, AreWhatASceneIsCheckedBy) {
  const TouchedBox box;
  const auto refusal = [&](const SceneDef& def) { return std::string(refusal_of(box, def).text); };
  const float vertex[3] = {};
  const auto with = [&](SceneDef def, const palpate_key& key, double value) {
    if (key.type == PALPATE_KEY_POINTER)
      def.render_mesh = value == 0 ? palpate_default_render_mesh() : render_mesh(vertex, nullptr, 1);
    else
      EXPECT_EQ(palpate_set_key(&key, &def, value), 1) << key.name;
    return def;
  };
  const auto key_of = [](const char* name) {
    const palpate_key* found = nullptr;
    for_each_key([&](const palpate_key& key) { found = std::strcmp(key.name, name) == 0 ? &key : found; });
    return *found;
  };
  for (const Effect* effect : all_effects()) {
    const EffectKey& first = effect->keys[0];
    if (first.type == PALPATE_KEY_POINTER) continue;
    const SceneDef off;
    SceneDef on = with(off, first, 1);
    for (const EffectKey& key : effect->keys.subspan(1))
      if (key.type != PALPATE_KEY_NUMBER) on = with(on, key, key.least);
    EXPECT_THAT(refusal(with(off, first, first.most + 1)), testing::HasSubstr(first.name));
    EXPECT_THAT(refusal(with(off, first, -1)), testing::HasSubstr(first.name));
    for (const EffectNeed& need : effect->needs) {
      // All needs are met but this one.
      SceneDef def = on;
      for (const EffectNeed& other : effect->needs)
        for (int value = 0; !other.is_met(def); ++value) def = with(def, key_of(other.key), value);
      int missing = 0;
      while (missing < 32 && (need.values >> missing & 1u) != 0) ++missing;
      // One that the library does not know at all is refused before.
      EXPECT_THAT(refusal(with(def, key_of(need.key), missing)),
                  testing::AnyOf(testing::HasSubstr(need.reason), testing::HasSubstr("is OFF")))
          << effect->name;
    }
  }
}

// ---- what hosts print from the keys ----------------------------------------------------------------------------------

// The types of a choice, a switch (off, on), a flag, a count and a number in a language.
struct Types {
  const char *choice, *switched, *flag, *count, *number, *between_words;
};
std::string type_of(const palpate_key& key, const Types& types) {
  if (key.type != PALPATE_KEY_CHOICE)
    return key.type == PALPATE_KEY_FLAG ? types.flag : key.type == PALPATE_KEY_COUNT ? types.count : types.number;
  const std::string words = fmt::format("{}", fmt::join(words_of(key), types.between_words));
  return fmt::format(fmt::runtime(std::string_view(key.words) == "off, on" ? types.switched : types.choice), words);
}

bool is_keyword(const palpate_key& key) {
  return key.type != PALPATE_KEY_POINTER && !std::strchr(key.name, '.');
}

std::string python_lines() {
  constexpr Types types = {"Literal[{}]", "Union[bool, Literal[{}]]", "bool", "int", "float", ", "};
  std::string lines;
  for_each_key([&](const palpate_key& key) {
    if (is_keyword(key)) lines += fmt::format("    {}: {}\n", key.name, type_of(key, types));
  });
  return lines;
}

std::string javascript_lines() {
  constexpr Types types = {"{}", "boolean | {}", "boolean", "number", "number", " | "};
  std::string lines = "/** @typedef {{", line;
  for_each_key([&](const palpate_key& key) {
    if (!is_keyword(key)) return;
    std::string name = key.name;
    for (std::size_t at; (at = name.find('_')) != std::string::npos;)
      name.erase(at, 1), name[at] = static_cast<char>(std::toupper(name[at]));
    const std::string field = fmt::format(" {}?: {},", name, type_of(key, types));
    if (line.empty() || line.size() + field.size() > 140) lines += std::exchange(line, "\n *  ");
    line += field;
  });
  return lines + line + "\n * }} SceneKeys */\n";
}

// The file has these lines between its two marks.
void expect_printed(const std::string& file, const std::string& lines) {
  const std::string text = source(file), mark = "Printed from palpate_scene_key():\n";
  const std::size_t begin = text.find(mark), end = text.find("(end of what is printed)");
  ASSERT_TRUE(begin < end && end != std::string::npos) << file;
  const std::string expected = text.substr(0, begin + mark.size()) + lines + text.substr(text.rfind('\n', end) + 1);
  if (text == expected) return;
  const std::filesystem::path printed = fresh_folder() / std::filesystem::path(file).filename();
  std::ofstream(printed) << expected;
  ADD_FAILURE() << file << " does not say what palpate_scene_key() says; replace it: cp " << printed.string() << ' '
                << file;
}

TEST(Descriptors, ArePrintedWhereHostsNeedThemAsText) {
  expect_printed("bindings/python/palpate/__init__.pyi", python_lines());
  expect_printed("bindings/web/module/palpate.js", javascript_lines());
}

}  // namespace
}  // namespace palpate::tests
