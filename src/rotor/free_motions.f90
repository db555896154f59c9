!! Motions of rotors that no stiffness holds, and that no damping feels, by structure: the six rigid motions of each shaft, of which
!! supports, bearings, closed meshes and what turns with the shaft hold some. Nothing is asked of assembled matrices.
module razy_rotor_free_motions
   use razy_core_kinds, only: wp
   use razy_linalg_dense, only: identity
   use razy_linalg_lapack, only: dpotrf, dpotrs
   use razy_linalg_null_space, only: intersection_of, null_space
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_reduction_reduced, only: reduced_t
   use razy_rotor_rotor, only: damping_nodal
   use razy_rotor_shaft_motions, only: append, first_column, list_bearings, list_held, list_motions
   implicit none(type, external)
   private

   public :: find_rotor_motions, in_coordinates, moves_of, rigid_motions, words_of

   !> A rigid motion is in the span of a reduction, to the error of its modes, or far from it.
   real(wp), parameter :: in_span = 1.0e-6_wp

contains

   !> Orthonormal bases (p, r each) of the motions of `reduced`, made from `model`, without stiffness, and without both;
   !> `gyroscopic` and `circulatory`: whether G and C act.
   subroutine find_rotor_motions(model, reduced, gyroscopic, circulatory, of_stiffness, of_both)
      type(rotor_model_t), intent(in) :: model
      type(reduced_t), intent(in) :: reduced
      logical, intent(in) :: gyroscopic, circulatory
      real(wp), allocatable, intent(out) :: of_stiffness(:, :), of_both(:, :)

      real(wp) :: moved(6*size(model%rotor%shaft), size(model%numbering%at))
      real(wp), allocatable :: felt(:, :), of_damping(:, :), stretched(:, :)
      integer :: info

      call list_motions(model%rotor, moved)
      call list_held(model%numbering, moved, stretched)
      felt = stretched
      call list_felt(model, moved, .true., circulatory, stretched)
      call list_felt(model, moved, .false., gyroscopic, felt)
      call in_coordinates(model, reduced, unfelt(stretched), of_stiffness)
      call in_coordinates(model, reduced, unfelt(felt), of_damping)
      call intersection_of(of_stiffness, of_damping, of_both, info)
   end subroutine find_rotor_motions

   !> Bases (6 shafts, r each) of the rigid motions that no stiffness holds, meshes closed if `meshed`, and of those among them that
   !> nothing feels: no circulatory matrix, where these act, no gyroscopic moment and, if `damped`, no damping. Rows are motions
   !> of each shaft along x, y and z, and about these.
   subroutine rigid_motions(model, gyroscopic, circulatory, damped, meshed, of_stiffness, untouched)
      type(rotor_model_t), intent(in) :: model
      logical, intent(in) :: gyroscopic, circulatory, damped, meshed
      real(wp), allocatable, intent(out) :: of_stiffness(:, :), untouched(:, :)

      real(wp) :: moved(6*size(model%rotor%shaft), size(model%numbering%at))
      real(wp), allocatable :: felt(:, :)

      call list_stretched(model, circulatory, meshed, moved, felt)
      of_stiffness = unfelt(felt)
      if (damped) then
         call list_felt(model, moved, .false., gyroscopic, felt)
      else if (gyroscopic) then
         call append_tilts(model, moved, felt)
      end if
      untouched = unfelt(felt)
   end subroutine rigid_motions

   !> What motions no stiffness holds at rest, meshes closed if `meshed`, in words; empty for none: a kind is free if fewer motions
   !> are left where it is held. A shaft that tilts about a bearing moves across its axis, too, but is not free to: only without
   !> tilting it would be.
   function words_of(model, meshed) result(words)
      type(rotor_model_t), intent(in) :: model
      logical, intent(in) :: meshed
      character(:), allocatable :: words

      character(*), parameter :: kinds(4) = [character(23) :: "to turn", "to move along the axis", "to move across the axis", &
                                                                                                     "to tilt"]
      integer, parameter :: kind_of(6) = [2, 3, 3, 1, 4, 4], asked(4) = [1, 2, 4, 3], tilting = 4
      real(wp) :: moved(6*size(model%rotor%shaft), size(model%numbering%at))
      real(wp), allocatable :: felt(:, :), more(:, :)
      integer :: i, k, last
      logical :: free(4)

      call list_stretched(model, .false., meshed, moved, felt)
      associate (kind => kind_of([(modulo(i - 1, 6) + 1, i=1, size(moved, 1))]), motion => identity(size(moved, 1)))
         do k = 1, size(asked)
            more = felt
            call append(more, motion(:, pack([(i, i=1, size(kind))], kind == asked(k))))
            free(asked(k)) = size(unfelt(more), 2) < size(unfelt(felt), 2)
            if (asked(k) == tilting) felt = more
         end do
      end associate
      words = ""
      last = findloc(free, .true., dim=1, back=.true.)
      do k = 1, size(kinds)
         if (.not. free(k)) cycle
         if (len(words) > 0 .and. k < last) words = words//","
         if (len(words) > 0 .and. k == last) words = words//" and"
         words = words//" "//trim(kinds(k))
      end do
      if (len(words) > 0) words = "free"//words
   end function words_of

   !> How coordinates move in the rigid motions of the shafts, and what of these (6 shafts, k) is held or stretches a stiffness.
   subroutine list_stretched(model, circulatory, meshed, moved, felt)
      type(rotor_model_t), intent(in) :: model
      logical, intent(in) :: circulatory, meshed
      real(wp), intent(out) :: moved(:, :)
      real(wp), allocatable, intent(out) :: felt(:, :)

      call list_motions(model%rotor, moved)
      call list_held(model%numbering, moved, felt)
      call list_felt(model, moved, .true., circulatory, felt)
      if (meshed) call append(felt, matmul(moved(:, places(model)), model%mesh_direction))
   end subroutine list_stretched

   !> The places in (6, nodes) of the coordinates of the model.
   pure function places(model) result(at)
      type(rotor_model_t), intent(in) :: model
      integer :: at(model%numbering%n)

      integer :: i

      associate (number => reshape(model%numbering%at, [size(model%numbering%at)]))
         do i = 1, size(number)
            if (number(i) > 0) at(number(i)) = i
         end do
      end associate
   end function places

   !> Append what bearings feel by stiffness, or else by damping, and what internal damping, if its circulatory matrix `acts`, or
   !> else itself, and gyroscopic moments, if they act, feel.
   subroutine list_felt(model, moved, by_stiffness, acts, felt)
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: moved(:, :)
      logical, intent(in) :: by_stiffness, acts
      real(wp), allocatable, intent(inout) :: felt(:, :)

      integer :: i, s

      call list_bearings(model%rotor, moved, by_stiffness, felt)
      do s = 1, size(model%rotor%shaft)
         associate (shaft => model%rotor%shaft(s), column => first_column(model%rotor, s))
            ! Damping in proportion to masses feels whatever a shaft does.
            if (shaft%mass_damping > 0.0_wp .and. .not. by_stiffness) then
               call append(felt, moved(:, column + 1:column + 6*shaft%nodes()))
            end if
            if (model%rotor%damping == damping_nodal .and. shaft%damping_ratio > 0.0_wp .and. (acts .or. .not. by_stiffness)) then
               do i = 1, shaft%nodes()
                  call append(felt, moved(:, column + 6*i - 4:column + 6*i - 3))
               end do
            end if
         end associate
      end do
      if (.not. by_stiffness .and. acts) call append_tilts(model, moved, felt)
   end subroutine list_felt

   !> What gyroscopic moments feel.
   pure subroutine append_tilts(model, moved, felt)
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: moved(:, :)
      real(wp), allocatable, intent(inout) :: felt(:, :)

      integer :: s

      do s = 1, size(model%rotor%shaft)
         associate (column => first_column(model%rotor, s))
            if (abs(model%rotor%shaft(s)%speed_ratio) > 0.0_wp) call append(felt, moved(:, column + 5:column + 6))
         end associate
      end do
   end subroutine append_tilts

   !> The motions that none of the `rows` feels.
   function unfelt(rows) result(motion)
      real(wp), intent(in) :: rows(:, :)
      real(wp), allocatable :: motion(:, :)

      integer :: info

      call null_space(rows, motion, info)
   end function unfelt

   !> Motions (6 shafts, r) in the coordinates of the model (n, r).
   function moves_of(model, motion) result(moves)
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: motion(:, :)
      real(wp), allocatable :: moves(:, :)

      real(wp) :: moved(6*size(model%rotor%shaft), size(model%numbering%at))

      call list_motions(model%rotor, moved)
      moves = matmul(transpose(moved(:, places(model))), motion)
   end function moves_of

   !> Motions (6 shafts, r), as far as the reduction has them, in its coordinates, an orthonormal basis (p, r).
   subroutine in_coordinates(model, reduced, motion, free)
      type(rotor_model_t), intent(in) :: model
      type(reduced_t), intent(in) :: reduced
      real(wp), intent(in) :: motion(:, :)
      real(wp), allocatable, intent(out) :: free(:, :)

      real(wp), allocatable :: factor(:, :), moves(:, :)
      integer :: i, info, kept, p

      p = size(reduced%basis, 2)
      moves = moves_of(model, motion)
      allocate (free(p, size(moves, 2)))
      factor = reduced%mass
      call dpotrf("L", p, factor, p, info)
      kept = 0
      do i = 1, size(moves, 2)
         free(:, kept + 1) = matmul(model%mass%times(moves(:, i)), reduced%basis)
         call dpotrs("L", p, 1, factor, p, free(:, kept + 1:kept + 1), p, info)
         if (norm2(matmul(reduced%basis, free(:, kept + 1)) - moves(:, i)) <= in_span*norm2(moves(:, i))) kept = kept + 1
      end do
      free = free(:, :kept)
      do i = 1, kept
         free(:, i) = free(:, i) - matmul(free(:, :i - 1), matmul(free(:, i), free(:, :i - 1)))
         free(:, i) = free(:, i)/norm2(free(:, i))
      end do
   end subroutine in_coordinates

end module razy_rotor_free_motions
