// The keys of palpate_scene_def and the descriptors of the effects: what they say, and that every host has the effects' keys.
#include <regex>
#include <set>
#include <sstream>

#include "runtime/complete/effects.h"
#include "tests/runtime/touched_box.h"

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

std::size_t offset_of(const palpate_key& key) {
  return static_cast<std::size_t>(key.offset);
}

std::vector<std::string> words_of(const palpate_key& key) {
  std::vector<std::string> words;
  std::istringstream list(key.words);
  for (std::string word; std::getline(list >> std::ws, word, ',');) words.push_back('"' + word + '"');
  return words;
}

template <class Each>
void for_every_key(Each each) {
  for (const Effect* effect : all_effects())
    for (const EffectKey& key : effect->keys) each(*effect, key);
}

// "relaxation" of "relaxation.terms": hosts give a struct in one.
std::string field_of(const EffectKey& key) {
  const std::string name = key.name;
  return name.substr(0, name.find('.'));
}

// Off, on of the words in a list of any language: "off", "on".
std::string words_in(const std::string& list) {
  std::string words;
  const std::regex word("\"([^\"]*)\"");
  for (std::sregex_iterator i(list.begin(), list.end(), word), end; i != end; ++i)
    words += (words.empty() ? "" : ", ") + (*i)[1].str();
  return words;
}

// The words that follow a place in a text, up to `close`; "" where the text does not have the place.
std::string words_behind(const std::string& text, const std::string& place, char close) {
  const std::size_t at = text.find(place);
  if (at == std::string::npos) return "";
  const std::size_t begin = at + place.size();
  return words_in(text.substr(begin, text.find(close, begin) - begin));
}

TEST(Descriptors, HaveNamesAndFieldsOfTheirOwn) {
  std::set<std::string> names;
  std::vector<int> owners(sizeof(palpate_scene_def), 0);
  for (const Effect* effect : all_effects()) {
    EXPECT_TRUE(names.insert(effect->name).second) << effect->name;
    EXPECT_TRUE(effect->build || effect->prepare) << effect->name;
    EXPECT_FALSE(effect->keys.empty()) << effect->name;
  }
  std::size_t keys = core_keys().size();
  for (const Effect* effect : all_effects()) keys += effect->keys.size();
  for_each_key([&](const palpate_key& key) {
    const auto begin = static_cast<std::size_t>(key.offset), end = begin + static_cast<std::size_t>(key.bytes);
    ASSERT_LE(end, owners.size()) << key.name;
    for (std::size_t b = begin; b < end; ++b) EXPECT_EQ(owners[b]++, 0) << key.name;
    --keys;
  });
  EXPECT_EQ(keys, 0u);
  EXPECT_EQ(palpate_scene_key(-1), nullptr);
  // The 4 bytes in front of an 8-byte field may be padding. Of a field without a key a saved state would not know.
  for_each_key([&](const palpate_key& key) {
    const auto field = owners.begin() + key.offset;
    if (key.bytes % 8 == 0) std::fill(field - 4, field, 1);
  });
  EXPECT_EQ(std::count(owners.begin() + sizeof(std::uint32_t), owners.end(), 0), 0);
}

TEST(Descriptors, AreOfEffectsThatAreOffByDefault) {
  const palpate_scene_def def = palpate_default_scene_def();
  for (const Effect* effect : all_effects()) EXPECT_FALSE(effect->is_on(def)) << effect->name;
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

std::string refusal_of(const TouchedBox& box, const palpate_scene_def& def) {
  palpate_scene* scene = nullptr;
  palpate_error error = {};
  EXPECT_NE(palpate_scene_create(box.bundle(), &def, &scene, &error), PALPATE_OK);
  palpate_scene_destroy(scene);
  return error.text;
}

// Every field of the core is refused by its name outside of its limits.
TEST(Descriptors, SayTheLimitsOfTheCore) {
  const TouchedBox box;
  for (const EffectKey& key : core_keys()) {
    if (key.type == PALPATE_KEY_POINTER) continue;
    for (const double value : {key.least - 1, key.most + 1, static_cast<double>(NAN)}) {
      if (value > 1e300) continue;
      palpate_scene_def def = palpate_default_scene_def();
      palpate_set_key(&key, &def, value);
      EXPECT_THAT(refusal_of(box, def), testing::HasSubstr(std::string("palpate_scene_def: ") + key.name));
    }
  }
}

// A value outside of its limits is refused by its name, and one that the effect excludes with the reason.
TEST(Descriptors, AreWhatASceneIsCheckedBy) {
  const TouchedBox box;
  const auto refusal = [&](const palpate_scene_def& def) { return refusal_of(box, def); };
  const auto with = [](palpate_scene_def def, std::size_t at, int value) {
    std::memcpy(reinterpret_cast<unsigned char*>(&def) + at, &value, sizeof value);
    return def;
  };
  for (const Effect* effect : all_effects()) {
    const EffectKey& first = effect->keys[0];
    if (first.type == PALPATE_KEY_POINTER) continue;
    const palpate_scene_def off = palpate_default_scene_def();
    palpate_scene_def on = with(off, offset_of(first), 1);
    for (const EffectKey& key : effect->keys.subspan(1))
      if (key.type != PALPATE_KEY_NUMBER) on = with(on, offset_of(key), static_cast<int>(key.least));
    EXPECT_THAT(refusal(with(off, offset_of(first), static_cast<int>(first.most) + 1)), testing::HasSubstr(first.name));
    EXPECT_THAT(refusal(with(off, offset_of(first), -1)), testing::HasSubstr(first.name));
    for (const EffectNeed& need : effect->needs) {
      // All needs are met but this one.
      palpate_scene_def def = on;
      for (const EffectNeed& other : effect->needs)
        for (int value = 0; !other.is_met(def); ++value) def = with(def, other.at, value);
      int missing = 0;
      while (missing < 32 && (need.values >> missing & 1u) != 0) ++missing;
      // One that the library does not know at all is refused before.
      EXPECT_THAT(refusal(with(def, need.at, missing)),
                  testing::AnyOf(testing::HasSubstr(need.reason), testing::HasSubstr("is OFF")))
          << effect->name;
    }
  }
}

TEST(Descriptors, HaveAKeywordInPythonWithTheirWords) {
  const std::string bound = source("bindings/python/effects.h"), typed = source("bindings/python/palpate/__init__.pyi");
  for_every_key([&](const Effect&, const EffectKey& key) {
    const std::string field = field_of(key);
    EXPECT_THAT(bound, testing::HasSubstr("py::arg(\"" + field + "\")"));
    EXPECT_THAT(typed, testing::HasSubstr(field + ":"));
    const std::string words = words_behind(bound, "(\"" + field + "\", " + field + ", {", '}');
    if (words.empty()) return;
    EXPECT_EQ(words, key.words) << field;
  });
}

TEST(Descriptors, HaveAFieldInJavaScriptWithTheirWords) {
  const std::string names = source("bindings/web/module/scene_def.js"),
                    offsets = source("bindings/web/module/struct_fields.c");
  const std::string of_def = offsets.substr(offsets.find("STRUCT(palpate_scene_def,"));
  const std::string fields = of_def.substr(0, of_def.find(')'));
  for_every_key([&](const Effect&, const EffectKey& key) {
    EXPECT_TRUE(std::regex_search(fields, std::regex("[ ,]" + std::string(key.name) + "(,|$)"))) << key.name;
    const std::string words = words_behind(names, "\n  " + field_of(key) + ": [", ']');
    if (!words.empty())
      EXPECT_EQ(words, key.words) << key.name;
    else
      EXPECT_THAT(names, testing::ContainsRegex("[\".]" + field_of(key))) << key.name;
  });
}

}  // namespace
}  // namespace palpate::tests
