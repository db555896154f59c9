!! Observables on the state of a machine that a right-hand side is made for: values, rates, and sizes of what they are sums of.
module razy_hybrid_field_observed
   use razy_core_kinds, only: wp
   use razy_hybrid_field, only: field_t
   use razy_hybrid_mode, only: constrained, idle
   use razy_machine_machine, only: observe_contact_force
   implicit none(type, external)
   private

   public :: observed, observed_rate, observed_size

contains

   !> Observable `form` at (tau, z).
   function observed(self, form, tau, z) result(value)
      class(field_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau, z(:)
      real(wp) :: value

      real(wp) :: a(self%m)
      integer :: i, t

      associate (observable => self%machine%observable(form))
         if (observable%kind == observe_contact_force) then
            call self%accelerate(tau, z, a)
            value = 0.0_wp
            associate (j => observable%contact)
               if (self%does(j) /= idle) value = self%machine%contact(j)%force_sign*self%force(j)
            end associate
            return
         end if
         call self%look_at_time(tau)
         value = observable%constant
         do i = 1, self%m
            value = value + (self%on_y(i, form)*z(i) + self%on_v(i, form)*z(self%m + i))
         end do
         do t = 1, size(self%omega)
            value = value + real(observable%error(t))*self%c(t) - aimag(observable%error(t))*self%d(t)
         end do
      end associate
   end function observed

   !> Rate of observable `form` at (tau, z), and the size of the terms that it is the sum of; a constraint force's is a
   !> difference over `delta`, s, along the motion.
   subroutine observed_rate(self, form, tau, z, delta, rate, size_of)
      class(field_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau, z(:), delta
      real(wp), intent(out) :: rate, size_of

      real(wp) :: a(self%m)
      integer :: i, t

      associate (observable => self%machine%observable(form), m => self%m)
         a = 0.0_wp
         if (observable%kind == observe_contact_force .or. any(abs(self%on_v(:, form)) > 0.0_wp)) call self%accelerate(tau, z, a)
         if (observable%kind == observe_contact_force) then
            call force_rate(self, observable%contact, tau, z, a, delta, rate, size_of)
            return
         end if
         call self%look_at_time(tau)
         rate = 0.0_wp
         size_of = 0.0_wp
         do i = 1, m
            rate = rate + (self%on_y(i, form)*z(m + i) + self%on_v(i, form)*a(i))
            size_of = size_of + (abs(self%on_y(i, form)*z(m + i)) + abs(self%on_v(i, form)*a(i)))
         end do
         do t = 1, size(self%omega)
            rate = rate - self%omega(t)*(real(observable%error(t))*self%d(t) + aimag(observable%error(t))*self%c(t))
            size_of = size_of + self%omega(t)*abs(observable%error(t))
         end do
      end associate
   end subroutine observed_rate

   !> Rate of the reported force of contact j at (tau, z), where `accelerate` has left a and the forces: by the slopes of a
   !> compliant law, else as a difference over `delta` along the motion.
   subroutine force_rate(self, j, tau, z, a, delta, rate, size_of)
      class(field_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: tau, z(:), a(:), delta
      real(wp), intent(out) :: rate, size_of

      real(wp) :: b(self%m), damping, moved(2*self%m), now, stiffness

      rate = 0.0_wp
      size_of = 0.0_wp
      if (self%does(j) == idle) return
      associate (sign_of => self%machine%contact(j)%force_sign, m => self%m)
         if (self%does(j) /= constrained .and. .not. self%machine%contact(j)%law%of_normal) then
            call self%slopes_of(j, stiffness, damping)
            rate = sign_of*(stiffness*self%rate(j) + damping*self%second_rate(j, a))
            size_of = abs(stiffness)*norm2(self%w(:, j))*norm2(z(m + 1:)) + abs(damping)*norm2(self%w(:, j))*norm2(a)
            return
         end if
         now = self%force(j)
         moved(:m) = z(:m) + delta*z(m + 1:)
         moved(m + 1:) = z(m + 1:) + delta*a
         call self%accelerate(tau + delta, moved, b)
         rate = sign_of*(self%force(j) - now)/delta
         size_of = abs(rate) + 8*abs(now)/delta
      end associate
   end subroutine force_rate

   !> Size of the terms that observable `form` is the sum of at z, where `observed` has just been asked.
   function observed_size(self, form, z) result(size_of)
      class(field_t), intent(in) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: z(:)
      real(wp) :: size_of

      real(wp) :: damping, stiffness

      associate (observable => self%machine%observable(form), m => self%m)
         if (observable%kind /= observe_contact_force) then
            size_of = abs(observable%constant) + sum(abs(observable%error)) + sum(abs(self%on_y(:, form)*z(:m))) &
                      + sum(abs(self%on_v(:, form)*z(m + 1:)))
            return
         end if
         size_of = 0.0_wp
         associate (j => observable%contact)
            if (self%does(j) == idle) return
            size_of = abs(self%force(j))
            if (self%does(j) == constrained) return
            call self%slopes_of(j, stiffness, damping)
            size_of = size_of + abs(stiffness)*(abs(self%machine%contact(j)%offset) + norm2(self%w(:, j))*norm2(z(:m))) &
                      + abs(damping)*norm2(self%w(:, j))*norm2(z(m + 1:))
         end associate
      end associate
   end function observed_size

end module razy_hybrid_field_observed
