#include "procs/renderer/gl_context.h"

// Order matters: epoxy must come before any other GL header.
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <utility>

#include "procs/renderer/gl_objects.h"

namespace foresight {
namespace {

constexpr int kMaxSide_px = 8192;

void check_size(int width, int height) {
  if (width > 0 && height > 0 && width <= kMaxSide_px && height <= kMaxSide_px) return;
  throw GlError("picture size " + std::to_string(width) + "x" + std::to_string(height) +
                " is outside 1..." + std::to_string(kMaxSide_px) + " px: correct the parameters");
}

void flip_rows(Image* image) {
  const auto stride = static_cast<std::ptrdiff_t>(image->width_px) * image->channels;
  for (int top = 0, bottom = image->height_px - 1; top < bottom; ++top, --bottom) {
    std::swap_ranges(image->bytes.begin() + top * stride, image->bytes.begin() + (top + 1) * stride,
                     image->bytes.begin() + bottom * stride);
  }
}

}  // namespace

void GlContext::bind() {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer());
  glViewport(0, 0, width_px(), height_px());
}

Image GlContext::read_rgb() { return read_rgb(width_px(), height_px()); }

Image GlContext::read_rgb(int width, int height) {
  Image image{std::clamp(width, 1, width_px()), std::clamp(height, 1, height_px()), 3, {}};
  image.bytes.resize(static_cast<size_t>(image.width_px) * image.height_px * 3);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer());
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, height_px() - image.height_px, image.width_px, image.height_px, GL_RGB,
               GL_UNSIGNED_BYTE, image.bytes.data());
  flip_rows(&image);
  return image;
}

// --- off screen
// -----------------------------------------------------------------------------------

struct OffscreenContext::Egl {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;
  int width_px = 0, height_px = 0;
  GlTexture colour;
  GlFramebuffer framebuffer;

  ~Egl() {
    if (context != EGL_NO_CONTEXT) {
      eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context);
      framebuffer = {};
      colour = {};
      eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
      eglDestroyContext(display, context);
    }
  }
  void open();
  void make_target(int width, int height);
};

void OffscreenContext::Egl::open() {
  const char* extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  if (extensions == nullptr ||
      std::string(extensions).find("EGL_MESA_platform_surfaceless") == std::string::npos) {
    throw GlError("EGL has no surfaceless platform: install Mesa's libegl1 and libgl1-mesa-dri");
  }
  display = eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
  if (display == EGL_NO_DISPLAY || eglInitialize(display, nullptr, nullptr) != EGL_TRUE) {
    throw GlError(
        "EGL does not start off screen: install libgl1-mesa-dri, or set "
        "LIBGL_ALWAYS_SOFTWARE=1");
  }
  eglBindAPI(EGL_OPENGL_API);
  const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                               3,
                               EGL_CONTEXT_MINOR_VERSION,
                               3,
                               EGL_CONTEXT_OPENGL_PROFILE_MASK,
                               EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                               EGL_NONE};
  context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
  if (context == EGL_NO_CONTEXT ||
      eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context) != EGL_TRUE) {
    throw GlError(
        "EGL offers no OpenGL 3.3 core context: update the GL driver, or set "
        "LIBGL_ALWAYS_SOFTWARE=1");
  }
}

void OffscreenContext::Egl::make_target(int width, int height) {
  width_px = width;
  height_px = height;
  colour = make_texture(GL_RGBA8, width, height, GL_NEAREST);
  framebuffer = make_framebuffer();
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, colour.name(), 0);
  require_complete_framebuffer("off screen");
  glViewport(0, 0, width, height);
}

OffscreenContext::OffscreenContext(int width_px, int height_px) : egl_(std::make_unique<Egl>()) {
  check_size(width_px, height_px);
  egl_->open();
  egl_->make_target(width_px, height_px);
}

OffscreenContext::~OffscreenContext() = default;

void OffscreenContext::make_current() {
  eglMakeCurrent(egl_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, egl_->context);
}
unsigned OffscreenContext::framebuffer() const { return egl_->framebuffer.name(); }
int OffscreenContext::width_px() const { return egl_->width_px; }
int OffscreenContext::height_px() const { return egl_->height_px; }
void OffscreenContext::present() { glFinish(); }  // shown when it is finished

// --- window
// ---------------------------------------------------------------------------------------

struct WindowContext::Glfw {
  GLFWwindow* window = nullptr;
  std::vector<int> keys;

  ~Glfw() {
    if (window != nullptr) glfwDestroyWindow(window);
    glfwTerminate();
  }
};

namespace {

std::string glfw_reason() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text == nullptr ? "unknown reason" : text;
}

}  // namespace

WindowContext::WindowContext(const WindowOptions& options) : glfw_(std::make_unique<Glfw>()) {
  check_size(options.width_px, options.height_px);
  if (glfwInit() != GLFW_TRUE) {
    throw GlError("no display for a window (" + glfw_reason() +
                  "): set DISPLAY, start under xvfb-run, or draw off screen");
  }
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_VISIBLE, options.visible ? GLFW_TRUE : GLFW_FALSE);
  glfw_->window = glfwCreateWindow(options.width_px, options.height_px, options.title.c_str(),
                                   nullptr, nullptr);
  if (glfw_->window == nullptr) {
    throw GlError("no window with OpenGL 3.3 core (" + glfw_reason() +
                  "): update the GL driver, or set LIBGL_ALWAYS_SOFTWARE=1");
  }
  glfwMakeContextCurrent(glfw_->window);
  glfwSwapInterval(options.wait_for_display ? 1 : 0);
  glfwSetWindowUserPointer(glfw_->window, &glfw_->keys);
  glfwSetKeyCallback(glfw_->window, [](GLFWwindow* window, int key, int, int action, int) {
    if (action == GLFW_RELEASE) return;
    static_cast<std::vector<int>*>(glfwGetWindowUserPointer(window))->push_back(key);
  });
  bind();
}

WindowContext::~WindowContext() = default;

void WindowContext::make_current() { glfwMakeContextCurrent(glfw_->window); }

int WindowContext::width_px() const {
  int width = 0, height = 0;
  glfwGetFramebufferSize(glfw_->window, &width, &height);
  return std::max(width, 1);
}

int WindowContext::height_px() const {
  int width = 0, height = 0;
  glfwGetFramebufferSize(glfw_->window, &width, &height);
  return std::max(height, 1);
}

void WindowContext::present() {
  glfwSwapBuffers(glfw_->window);
  glfwPollEvents();
}

bool WindowContext::should_close() const {
  return glfwWindowShouldClose(glfw_->window) == GLFW_TRUE;
}

std::vector<int> WindowContext::take_keys() { return std::exchange(glfw_->keys, {}); }

}  // namespace foresight
