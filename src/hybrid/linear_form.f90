!! The force of every contact in one contact state as a linear form of the motion, F = a·y + b·y' + c + Re(Σ e_t e^{iω_t t}).
!!
!! A law that is piecewise linear gives F = k s + b s' + offset in a branch; friction that slides gives the same form of its
!! normal force, F = μ N, where N is constant, or the force of a compliant contact with the sign that it has (`press`), or that
!! of a rigid contact, which is a constraint force and comes in later (razy_exact_constrained_motion).
module razy_hybrid_linear_form
   use razy_contact_contact_law, only: branch_lower_parting, branch_open, branch_upper_parting
   use razy_core_kinds, only: wp
   use razy_machine_machine, only: machine_t, observable_t
   implicit none(type, external)
   private

   public :: add_contacts, add_form, add_loads, contact_form, force_form, linear_form_t, normal_form, observable_form, zero_form

   !> f = on_y·y + on_v·y' + constant + Re(Σ error_t e^{iω_t t}).
   type :: linear_form_t
      real(wp), allocatable :: on_y(:), on_v(:)
      real(wp) :: constant = 0.0_wp
      complex(wp), allocatable :: error(:)
   end type linear_form_t

contains

   !> The form 0 of m coordinates.
   pure function zero_form(m, tones) result(form)
      integer, intent(in) :: m, tones
      type(linear_form_t) :: form

      allocate (form%on_y(m), form%on_v(m), source=0.0_wp)
      allocate (form%error(tones), source=(0.0_wp, 0.0_wp))
   end function zero_form

   !> Add `factor` times another form.
   pure subroutine add_form(form, factor, other)
      type(linear_form_t), intent(inout) :: form
      real(wp), intent(in) :: factor
      type(linear_form_t), intent(in) :: other

      form%on_y = form%on_y + factor*other%on_y
      form%on_v = form%on_v + factor*other%on_v
      form%constant = form%constant + factor*other%constant
      form%error = form%error + factor*other%error
   end subroutine add_form

   !> alpha s + beta s' + gamma of contact j, whose direction is `w` (m, contacts).
   pure function contact_form(machine, w, j, alpha, beta, gamma) result(form)
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: w(:, :)
      integer, intent(in) :: j
      real(wp), intent(in) :: alpha, beta, gamma
      type(linear_form_t) :: form

      integer :: t

      associate (contact => machine%contact(j))
         form%on_y = alpha*w(:, j)
         form%on_v = beta*w(:, j)
         form%constant = alpha*contact%offset + beta*contact%drive + gamma
         form%error = [(cmplx(alpha, machine%tone(t)%omega*beta, wp)*contact%error(t), t=1, size(machine%tone))]
      end associate
   end function contact_form

   !> A linear observable, with S (m, n) of the coupled coordinates.
   pure function observable_form(observable, project) result(form)
      type(observable_t), intent(in) :: observable
      real(wp), intent(in) :: project(:, :)
      type(linear_form_t) :: form

      form%on_y = matmul(project, observable%on_displacement)
      form%on_v = matmul(project, observable%on_velocity)
      form%constant = observable%constant
      form%error = observable%error
   end function observable_form

   !> F of contact j in the branches `branch`, without constraint forces.
   pure function force_form(machine, w, branch, press, j) result(form)
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: w(:, :)
      integer, intent(in) :: branch(:), press(:), j
      type(linear_form_t) :: form

      associate (law => machine%contact(j)%law)
         associate (piece => law%branch(branch(j)))
            if (law%constraint(branch(j))) then
               form = zero_form(size(w, 1), size(machine%tone))
            else if (law%of_normal) then
               form = zero_form(size(w, 1), size(machine%tone))
               call add_form(form, piece%offset, normal_form(machine, w, branch, press, j))
            else
               form = contact_form(machine, w, j, piece%stiffness, piece%damping, piece%offset)
            end if
         end associate
      end associate
   end function force_form

   !> Normal force of friction element j, without that of a rigid contact.
   pure function normal_form(machine, w, branch, press, j) result(form)
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: w(:, :)
      integer, intent(in) :: branch(:), press(:), j
      type(linear_form_t) :: form

      type(linear_form_t) :: by

      form = zero_form(size(w, 1), size(machine%tone))
      if (.not. is_pressed(machine, branch, j)) return
      form%constant = machine%contact(j)%normal
      associate (k => machine%contact(j)%normal_of)
         if (k == 0) return
         associate (law => machine%contact(k)%law)
            if (law%constraint(branch(k))) return
            by = contact_form(machine, w, k, law%branch(branch(k))%stiffness, law%branch(branch(k))%damping, &
                              law%branch(branch(k))%offset)
            call add_form(form, real(press(j), wp), by)
         end associate
      end associate
   end function normal_form

   !> Whether friction element j has a normal force at all: not while the contact that it goes with is open.
   pure function is_pressed(machine, branch, j) result(pressed)
      type(machine_t), intent(in) :: machine
      integer, intent(in) :: branch(:), j
      logical :: pressed

      pressed = .true.
      associate (with => machine%contact(j)%only_with)
         if (with == 0) return
         pressed = branch(with) /= branch_open .and. branch(with) /= branch_upper_parting .and. branch(with) /= branch_lower_parting
      end associate
   end function is_pressed

   !> Add what the contacts do in the branches `branch`, without constraint forces, to K and B (m, m).
   subroutine add_contacts(machine, w, branch, press, k, b)
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: w(:, :)
      integer, intent(in) :: branch(:), press(:)
      real(wp), intent(inout) :: k(:, :), b(:, :)

      type(linear_form_t) :: force
      integer :: i, j

      do j = 1, size(branch)
         force = force_form(machine, w, branch, press, j)
         do i = 1, size(w, 1)
            k(:, i) = k(:, i) + w(:, j)*force%on_y(i)
            b(:, i) = b(:, i) + w(:, j)*force%on_v(i)
         end do
      end do
   end subroutine add_contacts

   !> Add what does not depend on the motion to the load (m) and its phasors (m, tones).
   subroutine add_loads(machine, w, branch, press, load, harmonic)
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: w(:, :)
      integer, intent(in) :: branch(:), press(:)
      real(wp), intent(inout) :: load(:)
      complex(wp), intent(inout) :: harmonic(:, :)

      type(linear_form_t) :: force
      integer :: j, t

      do j = 1, size(branch)
         force = force_form(machine, w, branch, press, j)
         load = load - w(:, j)*force%constant
         do t = 1, size(harmonic, 2)
            harmonic(:, t) = harmonic(:, t) - w(:, j)*force%error(t)
         end do
      end do
   end subroutine add_loads

end module razy_hybrid_linear_form
