!! Motions of a machine in coupled coordinates that no stiffness holds, and those of them that no damping feels either (rigid
!! motions), with contacts in whatever state.
!!
!! They follow from the directions of elements and contacts alone: what is free of the springs, and in its span what stretches no
!! contact that acts. No matrix in which elements have been added up is asked. The coupled coordinates span a subspace that is
!! invariant under K and B, so that of the orthonormal free motions of the whole machine (in the norm of M) some lie in it and the
!! others are orthogonal to it: Gram's matrix of their parts has the eigenvalues 0 and 1.
module razy_machine_free_motions
   use razy_core_kinds, only: wp
   use razy_linalg_eigen, only: symmetric_eigen
   use razy_linalg_null_space, only: complement_of, intersection_of, null_space, rank_bound
   use razy_machine_coupled, only: coupled_t
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: free_motions_t, keep_unstretched, linear_free_motions, new_free_motions, open_motions, part_of

   !> Orthonormal motions (m, r) with all contacts open, and how they stretch the contacts (r, rows), which each row belongs to; a
   !> stretch that is rounding of its terms is 0.
   type :: span_t
      real(wp), allocatable :: shape(:, :), stretch(:, :)
      integer, allocatable :: contact(:)
   end type span_t

   !> Those without stiffness, and those of them without damping. One array: where a type that is part of another has two parts of
   !> one type, gfortran 12 may free the first alone.
   type :: free_motions_t
      type(span_t), private :: of(2)
   contains
      procedure :: in_state
   end type free_motions_t

contains

   !> The free motions of `machine` that are in its coupled coordinates.
   subroutine new_free_motions(self, machine, coupled)
      type(free_motions_t), intent(out) :: self
      type(machine_t), intent(in) :: machine
      type(coupled_t), intent(in) :: coupled

      real(wp), allocatable :: both(:, :), of_stiffness(:, :)

      call open_motions(machine, of_stiffness, both)
      call new_span(self%of(1), machine, coupled, of_stiffness)
      call new_span(self%of(2), machine, coupled, both)
   end subroutine new_free_motions

   !> Orthonormal motions (n, r) without stiffness, and without stiffness and damping, with all contacts open.
   subroutine open_motions(machine, of_stiffness, both)
      type(machine_t), intent(in) :: machine
      real(wp), allocatable, intent(out) :: of_stiffness(:, :), both(:, :)

      real(wp), allocatable :: of_damping(:, :)
      integer :: info

      if (allocated(machine%free_of_stiffness)) then
         of_stiffness = machine%free_of_stiffness
         both = machine%free_of_both
      else
         call null_space(transpose(machine%stiffness), of_stiffness, info)
         call null_space(transpose(machine%damping), of_damping, info)
         call intersection_of(of_stiffness, of_damping, both, info)
      end if
   end subroutine open_motions

   !> The same where contacts are springs and dampers with the slopes `slope` (2, contacts) of force over gap and over its rate.
   subroutine linear_free_motions(machine, slope, of_stiffness, both)
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: slope(:, :)
      real(wp), allocatable, intent(out) :: of_stiffness(:, :), both(:, :)

      call open_motions(machine, of_stiffness, both)
      call keep_unstretched(of_stiffness, machine, abs(slope(1, :)) > 0.0_wp)
      call keep_unstretched(both, machine, abs(slope(1, :)) > 0.0_wp .or. abs(slope(2, :)) > 0.0_wp)
   end subroutine linear_free_motions

   !> Of the motions (n, r) those that stretch no contact that acts.
   subroutine keep_unstretched(motion, machine, act)
      real(wp), allocatable, intent(inout) :: motion(:, :)
      type(machine_t), intent(in) :: machine
      logical, intent(in) :: act(:)

      type(span_t) :: span
      real(wp), allocatable :: kept(:, :)

      span%shape = motion
      call find_stretch(span, machine, motion)
      call within(span, act, kept)
      call move_alloc(kept, motion)
   end subroutine keep_unstretched

   !> How `motion` (n, r) stretches the contacts, those in a plane in two directions. Entries of a motion can be rounding
   !> themselves, so what is rounding is measured by the largest stretch of a motion of this energy, whatever the units of
   !> coordinates.
   subroutine find_stretch(self, machine, motion)
      type(span_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: motion(:, :)

      real(wp) :: root(size(motion, 1)), speed(size(motion, 2)), w(size(motion, 1))
      integer :: contacts, i, j

      root = [(sqrt(machine%mass(i, i)), i=1, size(root))]
      speed = [(norm2(root*motion(:, i)), i=1, size(speed))]
      contacts = size(machine%contact)
      self%contact = [(j, j=1, contacts), pack([(j, j=1, contacts)], [(allocated(machine%contact(j)%frame), j=1, contacts)])]
      self%stretch = spread(speed, 2, size(self%contact))
      do j = 1, size(self%contact)
         w = machine%contact(self%contact(j))%w
         if (j > contacts) w = machine%contact(self%contact(j))%frame%across
         self%stretch(:, j) = matmul(w, motion)
         where (abs(self%stretch(:, j)) <= rank_bound*norm2(w/root)*speed) self%stretch(:, j) = 0.0_wp
      end do
   end subroutine find_stretch

   !> The part of `motions` (n, r) that coupled coordinates hold.
   subroutine new_span(self, machine, coupled, motions)
      type(span_t), intent(out) :: self
      type(machine_t), intent(in) :: machine
      type(coupled_t), intent(in) :: coupled
      real(wp), intent(in) :: motions(:, :)

      real(wp), allocatable :: felt(:, :), gram(:, :), inside(:, :), value(:)
      integer :: info, r

      r = size(motions, 2)
      gram = matmul(transpose(motions), matmul(machine%mass, motions))
      allocate (value(r))
      call symmetric_eigen(gram, value, info)
      felt = matmul(motions, gram)/spread(sqrt(value), 1, size(motions, 1))
      inside = matmul(coupled%to_coupled, felt)
      call part_of(inside, self%shape, gram)
      felt = matmul(felt, gram)
      call find_stretch(self, machine, felt)
   end subroutine new_span

   !> An orthonormal basis `part` (p, r') of the columns of `whole` (p, r), the projections of orthonormal vectors of which some
   !> stay what they are and the others vanish; `chosen` (r, r'): part = whole chosen.
   subroutine part_of(whole, part, chosen)
      real(wp), intent(in) :: whole(:, :)
      real(wp), allocatable, intent(out) :: part(:, :), chosen(:, :)

      real(wp) :: gram(size(whole, 2), size(whole, 2)), value(size(whole, 2))
      integer :: info, lost

      gram = matmul(transpose(whole), whole)
      call symmetric_eigen(gram, value, info)
      lost = count(value < 0.5_wp)
      chosen = gram(:, lost + 1:)/spread(sqrt(value(lost + 1:)), 1, size(value))
      part = matmul(whole, chosen)
   end subroutine part_of

   !> An orthonormal basis `shape` (m, r) of the motions without stiffness where the contacts `held` (contacts) hold or have one,
   !> those `felt` have a damping or are held: the first `rigid` are free of damping, too.
   subroutine in_state(self, held, felt, shape, rigid)
      class(free_motions_t), intent(in) :: self
      logical, intent(in) :: held(:), felt(:)
      real(wp), allocatable, intent(out) :: shape(:, :)
      integer, intent(out) :: rigid

      real(wp), allocatable :: first(:, :), rest(:, :)

      call within(self%of(1), held, rest)
      call within(self%of(2), felt, first)
      rigid = size(first, 2)
      rest = matmul(rest, complement_of(matmul(transpose(rest), first)))
      shape = reshape([first, rest], [size(first, 1), rigid + size(rest, 2)])
   end subroutine in_state

   !> What stretches none of the contacts that `act`.
   subroutine within(self, act, shape)
      type(span_t), intent(in) :: self
      logical, intent(in) :: act(:)
      real(wp), allocatable, intent(out) :: shape(:, :)

      real(wp), allocatable :: basis(:, :)
      integer :: info, j

      call null_space(self%stretch(:, pack([(j, j=1, size(self%contact))], act(self%contact))), basis, info)
      shape = matmul(self%shape, basis)
   end subroutine within

end module razy_machine_free_motions
