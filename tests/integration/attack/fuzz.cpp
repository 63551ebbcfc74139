// Every method with messages that nobody should send, made from the descriptors: a method that is
// added tomorrow is attacked tomorrow.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <cmath>
#include <limits>
#include <random>
#include <set>

#include "client/net/connection.hpp"
#include "saccade/v1/session.pb.h"
#include "tests/integration/attack/attacks.hpp"

namespace saccade::testing {
namespace {

namespace pb = google::protobuf;
using Random = std::mt19937;

int Pick(Random& random, int below) {
  return static_cast<int>(random() % static_cast<unsigned>(below));
}

double EvilNumber(Random& random) {
  static const double kEvil[] = {std::nan(""), INFINITY, -INFINITY, 1e308, -1e308,   5e-324,
                                 -0.0,         0.0,      -1,        1,     1e9,      0.02,
                                 319.5,        1e17,     -1e-300,   10,    10.000001};
  return kEvil[Pick(random, std::size(kEvil))];
}

std::string EvilText(Random& random) {
  switch (Pick(random, 9)) {
    case 0:
      return "";
    case 1:
      return std::string(501, 'x');
    case 2:
      return std::string(100'000, 'y');
    case 3:
      return "a\x1b[2J\x07";
    case 4:
      return std::string("z\0z", 3);
    case 5:
      return "\xe2\x80\xae\xe2\x81\xa6 bidi";
    case 6:
      return net::RandomUuid();
    case 7:
      return "'; DROP TABLE annotations; --";
    default:
      return "%s%n%999999d";
  }
}

void SetScalar(pb::Message& message, const pb::FieldDescriptor& field, Random& random) {
  const pb::Reflection& set = *message.GetReflection();
  static const std::uint64_t kEvil[] = {0,
                                        1,
                                        2,
                                        33,
                                        257,
                                        0x7fffffff,
                                        0x80000000,
                                        0xffffffff,
                                        0x7fffffffffffffff,
                                        0x8000000000000000,
                                        ~0ull};
  const std::uint64_t whole = kEvil[Pick(random, std::size(kEvil))];
  const bool many = field.is_repeated();
  switch (field.cpp_type()) {
    case pb::FieldDescriptor::CPPTYPE_DOUBLE:
      return many ? set.AddDouble(&message, &field, EvilNumber(random))
                  : set.SetDouble(&message, &field, EvilNumber(random));
    case pb::FieldDescriptor::CPPTYPE_FLOAT:
      return many ? set.AddFloat(&message, &field, static_cast<float>(EvilNumber(random)))
                  : set.SetFloat(&message, &field, static_cast<float>(EvilNumber(random)));
    case pb::FieldDescriptor::CPPTYPE_INT32:
      return many ? set.AddInt32(&message, &field, static_cast<std::int32_t>(whole))
                  : set.SetInt32(&message, &field, static_cast<std::int32_t>(whole));
    case pb::FieldDescriptor::CPPTYPE_INT64:
      return many ? set.AddInt64(&message, &field, static_cast<std::int64_t>(whole))
                  : set.SetInt64(&message, &field, static_cast<std::int64_t>(whole));
    case pb::FieldDescriptor::CPPTYPE_UINT32:
      return many ? set.AddUInt32(&message, &field, static_cast<std::uint32_t>(whole))
                  : set.SetUInt32(&message, &field, static_cast<std::uint32_t>(whole));
    case pb::FieldDescriptor::CPPTYPE_UINT64:
      return many ? set.AddUInt64(&message, &field, whole) : set.SetUInt64(&message, &field, whole);
    case pb::FieldDescriptor::CPPTYPE_BOOL:
      return many ? set.AddBool(&message, &field, random() % 2)
                  : set.SetBool(&message, &field, random() % 2);
    case pb::FieldDescriptor::CPPTYPE_ENUM: {
      const int value = Pick(random, 2) != 0 ? Pick(random, 5) : static_cast<int>(whole);
      return many ? set.AddEnumValue(&message, &field, value)
                  : set.SetEnumValue(&message, &field, value);
    }
    default:
      return;
  }
}

struct Filler {
  Random random;
  std::string session_id;
  const std::string* text = nullptr;  // every string is this one

  std::string Text(const pb::FieldDescriptor& field) {
    if (text != nullptr) return *text;
    if (field.name().find("session_id") != std::string::npos && Pick(random, 10) < 8)
      return session_id;
    return EvilText(random);
  }

  void Fill(pb::Message& message, int depth = 0) {
    for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
      const pb::FieldDescriptor& field = *message.GetDescriptor()->field(i);
      if (text == nullptr && Pick(random, 6) == 0) continue;
      static const int kTimes[] = {0, 1, 1, 2, 3, 300};
      const int times = !field.is_repeated()                 ? 1
                        : depth > 0 && Pick(random, 20) == 0 ? 2001
                                                             : kTimes[Pick(random, 6)];
      for (int turn = 0; turn < times; ++turn) FillField(message, field, depth);
    }
  }

  void FillField(pb::Message& message, const pb::FieldDescriptor& field, int depth) {
    const pb::Reflection& set = *message.GetReflection();
    if (field.cpp_type() == pb::FieldDescriptor::CPPTYPE_MESSAGE) {
      if (depth > 6) return;
      Fill(field.is_repeated() ? *set.AddMessage(&message, &field)
                               : *set.MutableMessage(&message, &field),
           depth + 1);
    } else if (field.cpp_type() == pb::FieldDescriptor::CPPTYPE_STRING) {
      const std::string value = Text(field);
      if (field.is_repeated()) {
        set.AddString(&message, &field, value);
      } else {
        set.SetString(&message, &field, value);
      }
    } else {
      SetScalar(message, field, random);
    }
  }
};

void Collect(const pb::FileDescriptor& file, std::set<const pb::FileDescriptor*>& seen,
             std::vector<std::string>& names) {
  if (!seen.insert(&file).second) return;
  for (int i = 0; i < file.dependency_count(); ++i) Collect(*file.dependency(i), seen, names);
  for (int s = 0; s < file.service_count(); ++s) {
    for (int m = 0; m < file.service(s)->method_count(); ++m) {
      names.push_back("/" + file.service(s)->full_name() + "/" +
                      file.service(s)->method(m)->name());
    }
  }
}

std::string Filled(const std::string& method, Filler filler) {
  std::string name = method.substr(1);
  name[name.rfind('/')] = '.';
  const pb::MethodDescriptor* descriptor =
      pb::DescriptorPool::generated_pool()->FindMethodByName(name);
  if (descriptor == nullptr) return "";
  const std::unique_ptr<pb::Message> message(
      pb::MessageFactory::generated_factory()->GetPrototype(descriptor->input_type())->New());
  filler.Fill(*message);
  return message->SerializePartialAsString();
}

}  // namespace

// session.proto imports all others.
std::vector<std::string> MethodNames() {
  std::set<const pb::FileDescriptor*> seen;
  std::vector<std::string> names;
  Collect(*v1::Event::descriptor()->file(), seen, names);
  return names;
}

std::string FuzzedRequest(const std::string& method, const std::string& session_id,
                          std::uint32_t seed) {
  return Filled(method, {Random(seed), session_id, nullptr});
}

std::string RequestWithText(const std::string& method, const std::string& text) {
  return Filled(method, {Random(1), "", &text});
}

void FuzzMethods(const Battle& battle) {
  const auto channel = battle.target.NewChannel();
  std::vector<std::string> sessions = {"not a session"};
  for (const v1::Role role : {v1::ROLE_EXPERT, v1::ROLE_WEARER, v1::ROLE_VIEWER}) {
    sessions.push_back(JoinSession(channel, role, seconds(2)));
  }
  std::vector<std::string> methods = MethodNames();
  methods.push_back("/grpc.health.v1.Health/Check");
  methods.push_back("/grpc.health.v1.Health/Watch");
  methods.push_back("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo");
  const int port = battle.target.http_port();
  Random random(battle.seed);
  for (std::uint32_t turn = 0; !battle.over(); ++turn) {
    for (const std::string& method : methods) {
      if (battle.over()) return;
      std::string bytes = FuzzedRequest(method, sessions[random() % sessions.size()], random());
      if (bytes.empty() || turn % 3 == 2) {  // no message at all
        bytes.resize(random() % 200);
        for (char& byte : bytes) byte = static_cast<char>(random());
      }
      if (turn == 0) bytes.clear();
      if (turn % 2 == 0) {
        battle.tally.Add(Call(channel, method, bytes, milliseconds(300)).status);
      } else {
        Socket socket(port);
        socket.Send(GrpcWebCall(port, method, bytes));
        const std::string answer = socket.Receive(milliseconds(300), "grpc-status:", 65536);
        battle.tally.Add(answer.find("grpc-status:") != std::string::npos ? "status over HTTP"
                                                                          : "stream over HTTP");
      }
    }
  }
}

}  // namespace saccade::testing
