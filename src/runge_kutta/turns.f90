!! The rate of an observable that is a sum of displacements and errors, along a step of a Runge-Kutta method:
!!
!!     Σ_i a_i y_i' + d/dt Re(Σ_t e_t e^{iω_t t}),   with y' of the dense output.
!!
!! Speed and acceleration at the ends of the step mostly say that it does not turn (razy_runge_kutta_one_way). Else its own
!! polynomial is looked at.
module razy_runge_kutta_turns
   use razy_core_kinds, only: wp
   use razy_runge_kutta_methods_dense_output, only: dense_output_t, path_t
   use razy_hybrid_field, only: field_t
   use razy_runge_kutta_one_way, only: one_way
   use razy_runge_kutta_methods_step_strip, only: longest_strip, step_strip_t
   use razy_machine_machine, only: observe_contact_force
   implicit none(type, external)
   private

   public :: glimpse_sum, rate_path_t

   type :: rate_path_t
      !> The observable (0: none yet), and the step: start by the field's time and length, s.
      integer :: form = 0
      real(wp) :: start = 0.0_wp, h = 0.0_wp
      !> Rounding in the rate.
      real(wp) :: noise = 0.0_wp
      !> Whether an observable is such a sum (observables).
      logical, allocatable :: suits(:)
      type(path_t), private :: path
      !> Rates and accelerations at the start and the ends of the steps of a strip.
      real(wp), private :: rate(0:longest_strip) = 0.0_wp, bend(0:longest_strip) = 0.0_wp
   contains
      procedure :: attach
      procedure :: steady
      procedure :: survey
      procedure :: steady_in
      procedure :: follow
      procedure :: rate_at
   end type rate_path_t

   real(wp), parameter :: of_sum = 16*epsilon(1.0_wp)

contains

   !> See which observables of the field's machine are such sums.
   subroutine attach(self, field)
      class(rate_path_t), intent(inout) :: self
      type(field_t), intent(in) :: field

      integer :: form

      if (allocated(self%suits)) deallocate (self%suits)
      allocate (self%suits(size(field%machine%observable)))
      do form = 1, size(self%suits)
         self%suits(form) = field%machine%observable(form)%kind /= observe_contact_force &
                            .and. .not. any(abs(field%on_v(:, form)) > 0.0_wp)
      end do
   end subroutine attach

   !> Take observable `form` in the step h from `start`, with z and z' (2m each) at its ends. True if it moves in `direction`
   !> through all of it.
   function steady(self, field, form, start, h, direction, z0, z1, dz0, dz1)
      class(rate_path_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      integer, intent(in) :: form, direction
      real(wp), intent(in) :: start, h, z0(:), z1(:), dz0(:), dz1(:)
      logical :: steady

      real(wp) :: bend0, bend1, rate0, rate1, size_of
      integer :: i, m

      self%form = form
      self%start = start
      self%h = h
      m = field%m
      call of_errors(field, form, start, rate0, bend0, size_of)
      call of_errors(field, form, start + h, rate1, bend1, size_of)
      do i = 1, m
         rate0 = rate0 + field%on_y(i, form)*z0(m + i)
         rate1 = rate1 + field%on_y(i, form)*z1(m + i)
         bend0 = bend0 + field%on_y(i, form)*dz0(m + i)
         bend1 = bend1 + field%on_y(i, form)*dz1(m + i)
         size_of = size_of + abs(field%on_y(i, form))*max(abs(z0(m + i)), abs(z1(m + i)))
      end do
      self%noise = of_sum*size_of
      steady = min(direction*rate0, direction*rate1) > self%noise .and. one_way(h, rate0, rate1, bend0, bend1) == direction
   end function steady

   !> Take observable `form` at the start and the ends of `steps` steps of a strip.
   pure subroutine survey(self, field, form, strip, steps)
      class(rate_path_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      integer, intent(in) :: form, steps
      type(step_strip_t), intent(in) :: strip

      self%form = form
      call look(field%m, size(field%omega), steps, field%on_y(:, form), real(field%machine%observable(form)%error), &
                aimag(field%machine%observable(form)%error), field%omega, strip%u, self%rate, self%bend, self%noise)
      self%noise = of_sum*self%noise

   contains

      pure subroutine look(m, tones, steps, on, re, im, omega, u, rate, bend, size_of)
         integer, intent(in) :: m, tones, steps
         real(wp), intent(in) :: on(m), re(tones), im(tones), omega(tones), u(2*(m + tones), 0:longest_strip)
         real(wp), intent(inout) :: rate(0:longest_strip), bend(0:longest_strip)
         real(wp), intent(out) :: size_of

         real(wp) :: of_bend, of_rate, of_size
         integer :: i, k, t

         size_of = 0.0_wp
         do k = 0, steps
            of_rate = 0.0_wp
            of_bend = 0.0_wp
            of_size = 0.0_wp
            do i = 1, m
               of_rate = of_rate + on(i)*u(i, k)
               of_bend = of_bend + on(i)*u(m + i, k)
               of_size = of_size + abs(on(i)*u(i, k))
            end do
            do t = 1, tones
               associate (c => u(2*m + t, k), d => u(2*m + tones + t, k))
                  of_rate = of_rate - omega(t)*(re(t)*d + im(t)*c)
                  of_bend = of_bend - omega(t)**2*(re(t)*c - im(t)*d)
                  of_size = of_size + omega(t)*(abs(re(t)) + abs(im(t)))
               end associate
            end do
            rate(k) = of_rate
            bend(k) = of_bend
            size_of = max(size_of, of_size)
         end do
      end subroutine look

   end subroutine survey

   !> Whether the observable moves in `direction` through all of step k of the strip.
   pure logical function steady_in(self, strip, k, direction)
      class(rate_path_t), intent(in) :: self
      type(step_strip_t), intent(in) :: strip
      integer, intent(in) :: k, direction

      steady_in = min(direction*self%rate(k - 1), direction*self%rate(k)) > self%noise &
                  .and. one_way(strip%h, self%rate(k - 1), self%rate(k), self%bend(k - 1), self%bend(k)) == direction
   end function steady_in

   !> Take the polynomial of the step.
   pure subroutine follow(self, field, output)
      class(rate_path_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      type(dense_output_t), intent(in) :: output

      call output%follow(field%on_y(:, self%form), field%m, self%path)
   end subroutine follow

   !> The rate `tau` after the start of the step.
   function rate_at(self, field, tau) result(rate)
      class(rate_path_t), intent(in) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau
      real(wp) :: rate

      real(wp) :: unused, value
      integer :: t

      call field%look_at_time(self%start + tau)
      call self%path%look(tau/self%h, rate, unused)
      associate (observable => field%machine%observable(self%form))
         do t = 1, size(field%omega)
            associate (error => observable%error(t))
               value = error%re*field%d(t) + error%im*field%c(t)
            end associate
            rate = rate - field%omega(t)*value
         end do
      end associate
   end function rate_at

   !> Value, rate, size of the value's terms and rounding of the rate of observable `form` at (time, z).
   subroutine glimpse_sum(field, form, time, z, value, rate, size_of, noise)
      type(field_t), intent(inout) :: field
      integer, intent(in) :: form
      real(wp), intent(in) :: time, z(:)
      real(wp), intent(out) :: value, rate, size_of, noise

      integer :: i, t

      call field%look_at_time(time)
      associate (observable => field%machine%observable(form), m => field%m)
         value = observable%constant
         size_of = abs(value)
         rate = 0.0_wp
         noise = 0.0_wp
         do i = 1, m
            value = value + field%on_y(i, form)*z(i)
            size_of = size_of + abs(field%on_y(i, form)*z(i))
            rate = rate + field%on_y(i, form)*z(m + i)
            noise = noise + abs(field%on_y(i, form)*z(m + i))
         end do
         do t = 1, size(field%omega)
            associate (re => real(observable%error(t)), im => aimag(observable%error(t)), omega => field%omega(t))
               value = value + (re*field%c(t) - im*field%d(t))
               size_of = size_of + (abs(re) + abs(im))
               rate = rate - omega*(re*field%d(t) + im*field%c(t))
               noise = noise + omega*(abs(re) + abs(im))
            end associate
         end do
      end associate
      noise = of_sum*noise
   end subroutine glimpse_sum

   !> What the errors add to rate and acceleration of an observable, and the size of the terms of the rate.
   subroutine of_errors(field, form, time, rate, bend, size_of)
      type(field_t), intent(inout) :: field
      integer, intent(in) :: form
      real(wp), intent(in) :: time
      real(wp), intent(out) :: rate, bend, size_of

      integer :: t

      rate = 0.0_wp
      bend = 0.0_wp
      size_of = 0.0_wp
      call field%look_at_time(time)
      associate (observable => field%machine%observable(form))
         do t = 1, size(field%omega)
            associate (re => real(observable%error(t)), im => aimag(observable%error(t)), omega => field%omega(t))
               rate = rate - omega*(re*field%d(t) + im*field%c(t))
               bend = bend - omega**2*(re*field%c(t) - im*field%d(t))
               size_of = size_of + omega*(abs(re) + abs(im))
            end associate
         end do
      end associate
   end subroutine of_errors

end module razy_runge_kutta_turns
