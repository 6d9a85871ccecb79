#pragma once
// What a service throws becomes its reply.

#include <exception>

namespace ttsdf {

/// Runs `work`; the reply says what it threw. Always true: the call itself has worked.
template <class Response, class Work>
bool answer(Response& response, const Work& work) {
  try {
    work();
  } catch (const std::exception& error) {
    response.success = false;
    response.message = error.what();
  }
  return true;
}

}  // namespace ttsdf
